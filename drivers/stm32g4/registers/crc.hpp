// CRC calculation unit (RM0440, chapter CRC).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct CrcRegisters {
    volatile std::uint32_t DR;
    std::uint32_t reserved;
    volatile std::uint32_t CR;
};
static_assert(offsetof(CrcRegisters, CR) == 0x08);

constexpr std::uintptr_t kCrcBase = 0x4002'3000;

namespace crc {
constexpr std::uint32_t CR_RESET = 1U << 0U;
constexpr std::uint32_t CR_REV_IN_word = 3U << 5U;
constexpr std::uint32_t CR_REV_OUT = 1U << 7U;
}  // namespace crc

}  // namespace tricoil::stm32g4
