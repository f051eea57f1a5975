#include "sim/virtual_board/injected_code.hpp"

#include <array>

namespace tricoil::virtual_board {
namespace {

// The idle loop is long, because the emulator runs short loops slowly.
constexpr std::uint32_t kIdleNops = 1000;
constexpr std::uint32_t kIdle = Memory::kDataPages[1].offset - 2 * (kIdleNops + 2);
constexpr std::uint16_t kNop = 0xBF00;

/// Instructions of ARMv7-M (A7.7).
constexpr std::array<std::array<std::uint16_t, 4>, 3> kOthers{{
    {0x2003, 0x0700, 0x6800, 0xE7FE},  // movs r0, #3; lsls r0, r0, #28; ldr r0, [r0]; b .
    {0xB4FF, 0xE7FD, kNop, kNop},      // push {r0-r7}; b .-2
    {0x2001, 0x0740, 0x3001, 0x4700},  // movs r0, #1; lsls r0, r0, #29; adds r0, #1; bx r0
}};
constexpr std::uint32_t kBytesOfOther = sizeof kOthers[0];
constexpr std::uint32_t kFirstOther = kIdle - kOthers.size() * kBytesOfOther;

}  // namespace

void put_injected_code(Memory& memory) {
    const auto put = [&](std::uint32_t at, std::uint32_t half) {
        memory.flash[at] = static_cast<std::uint8_t>(half);
        memory.flash[at + 1] = static_cast<std::uint8_t>(half >> 8U);
    };
    for (std::uint32_t n = 0; n <= kIdleNops; ++n) {
        const bool last = n == kIdleNops;
        put(kIdle + 2 * n, last ? 0xE000U | ((2048U - n - 2U) & 0x7FFU) : kNop);  // branch to the first one (A7.7.12, T2)
    }
    std::uint32_t at = kFirstOther;
    for (const auto& code : kOthers) {
        for (const std::uint16_t half : code) {
            put(at, half);
            at += 2;
        }
    }
}

std::uint32_t address_of(InjectedCode code) {
    const std::uint32_t n = static_cast<std::uint32_t>(code);
    return Memory::kFlashBase + (n == 0 ? kIdle : kFirstOther + (n - 1) * kBytesOfOther);
}

}  // namespace tricoil::virtual_board
