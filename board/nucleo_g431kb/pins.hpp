// Pins of this board (UM2397).
#pragma once

#include <cstdint>

namespace tricoil::nucleo_g431kb {

constexpr unsigned kSerialTx = 2;  // PA2, USART2: the ST-LINK's virtual serial port
constexpr unsigned kSerialFunction = 7;
constexpr unsigned kLight = 8;                  // PB8, the green LED LD2
constexpr std::uintptr_t kSram2 = 0x2000'4000;  // above SRAM1
constexpr std::uintptr_t kCcmRam = 0x2000'5800;

}  // namespace tricoil::nucleo_g431kb

namespace tricoil {
namespace this_board = nucleo_g431kb;  // for the sources of board/stm32g4
}
