// Operational amplifiers (RM0440, chapter OPAMP).
#pragma once

#include <cstdint>

namespace tricoil::stm32g4 {

struct OpampRegisters {
    volatile std::uint32_t CSR[6];  // CSR[0] is op-amp 1
};

constexpr std::uintptr_t kOpampBase = 0x4001'0300;

namespace opamp {
constexpr std::uint32_t CSR_OPAEN = 1U << 0U;
constexpr std::uint32_t CSR_VP_SEL_dac = 3U << 2U;  // DAC3 or DAC4, for op-amps 1 and 3 to 6
constexpr std::uint32_t CSR_VM_SEL_ladder = 2U << 5U;
constexpr std::uint32_t CSR_VM_SEL_follower = 3U << 5U;
constexpr std::uint32_t CSR_OPAHSM = 1U << 7U;     // high-speed mode
constexpr std::uint32_t CSR_OPAINTOEN = 1U << 8U;  // output to the converter, not to the pin
constexpr unsigned CSR_PGA_GAIN_Pos = 14;          // 0-5: 2, 4, ... 64
constexpr std::uint32_t CSR_PGA_GAIN_ladder_to_VINM0 = 8U << 14U;
}  // namespace opamp

}  // namespace tricoil::stm32g4
