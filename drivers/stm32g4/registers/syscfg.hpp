// System configuration controller (RM0440, chapter SYSCFG): memory map.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4 {

struct SyscfgRegisters {
    volatile std::uint32_t MEMRMP;
};

constexpr std::uintptr_t kSyscfgBase = 0x4001'0000;

namespace syscfg {
/// Flash bank 2 is at 0x08000000 and bank 1 at 0x08040000. Every reset clears it.
constexpr std::uint32_t MEMRMP_FB_MODE = 1U << 8U;
}  // namespace syscfg

}  // namespace tricoil::stm32g4
