#include "sim/virtual_board/machine/memory.hpp"

#include <algorithm>
#include <cstring>

namespace tricoil::virtual_board {
namespace {

// RM0440 section 48 (device electronic signature).
constexpr std::uint32_t kThermometer30 = 0x75A8;   // TS_CAL1 and VREFINT_CAL: codes at 30 degrees Celsius and a supply of 3.0 V
constexpr std::uint32_t kThermometer130 = 0x75C8;  // TS_CAL2 is the upper half-word
constexpr std::uint32_t kUniqueId = 0x7590;
constexpr std::uint32_t kFlashSize = 0x75E0;
constexpr std::uint32_t kOptionBytes = 0x7800;
constexpr std::uint32_t kBootloaderEntry = 0x100;  // any address in system memory: the machine detects code that runs there

void put(std::vector<std::uint8_t>& memory, std::uint32_t at, std::uint32_t word) {
    std::memcpy(memory.data() + at, &word, sizeof word);
}

}  // namespace

Memory::Memory() : flash(kBankBytes, 0xFF), ram(kRamBytes), system(kSystemBytes, 0xFF) {
    lose_ram();
    put(system, 0, kRamBase + 0x3000);
    put(system, 4, kSystemBase + kBootloaderEntry + 1);
    put(system, kBootloaderEntry, 0xE7FEE7FE);  // b .
    put(system, kUniqueId, 0x00470047);         // wafer x, y
    put(system, kUniqueId + 4, 0x56425254);     // lot number, ASCII
    put(system, kUniqueId + 8, 0x304C4F43);
    put(system, kFlashSize, 512);
    set_options(kUserOptions);
    put(system, kThermometer30, 1654U << 16U | 1038U);     // 1.212 V, 0.76 V
    put(system, kThermometer130, 1379U << 16U | 0xFFFFU);  // 1.01 V at 130 degrees: 2.5 mV per degree
}

void Memory::set_options(std::uint32_t options) {
    put(system, kOptionBytes, options);
    put(system, kOptionBytes + 4, ~options);
}

void Memory::lose_ram() { std::fill(ram.begin(), ram.end(), kNeverWritten); }

std::span<std::uint8_t> Memory::at(std::uint32_t address, std::uint32_t size) {
    const auto part = [&](std::vector<std::uint8_t>& memory, std::uint32_t base, std::uint32_t bytes, std::uint32_t skip) {
        const bool inside = address >= base && address - base <= bytes && size <= bytes - (address - base);
        return inside ? std::span(memory).subspan(skip + address - base, size) : std::span<std::uint8_t>{};
    };
    for (const auto found : {part(ram, kRamBase, kRamBytes, 0), part(flash, kFlashBase, kBankBytes, 0),
                             part(ram, kCcmBase, kCcmBytes, kRamBytes - kCcmBytes), part(system, kSystemBase, kSystemBytes, 0),
                             part(flash, 0, kBankBytes, 0)}) {
        if (!found.empty()) {
            return found;
        }
    }
    return {};
}

std::uint32_t Memory::word(std::uint32_t address) {
    const auto bytes = at(address, 4);
    std::uint32_t value = 0xFFFFFFFF;
    if (!bytes.empty()) {
        std::memcpy(&value, bytes.data(), sizeof value);
    }
    return value;
}

}  // namespace tricoil::virtual_board
