// Independent watchdog (RM0440, chapter IWDG).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct IwdgRegisters {
    volatile std::uint32_t KR;
    volatile std::uint32_t PR;
    volatile std::uint32_t RLR;
    volatile std::uint32_t SR;
};
static_assert(offsetof(IwdgRegisters, SR) == 0x0C);

constexpr std::uintptr_t kIwdgBase = 0x4000'3000;

namespace iwdg {
constexpr std::uint32_t KR_start = 0xCCCC;
constexpr std::uint32_t KR_unlock = 0x5555;
constexpr std::uint32_t KR_feed = 0xAAAA;
constexpr std::uint32_t RLR_max = 0xFFF;
constexpr std::uint32_t SR_PVU = 1U << 0U;  // prescaler update in progress
constexpr std::uint32_t SR_RVU = 1U << 1U;  // reload value update in progress
}  // namespace iwdg

}  // namespace tricoil::stm32g4
