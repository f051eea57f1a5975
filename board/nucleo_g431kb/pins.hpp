// Pins of this board (UM2397).
#pragma once

namespace tricoil::nucleo_g431kb {

constexpr unsigned kSerialTx = 2;  // PA2, USART2: the ST-LINK's virtual serial port
constexpr unsigned kSerialFunction = 7;
constexpr unsigned kLight = 8;  // PB8, the green LED LD2

}  // namespace tricoil::nucleo_g431kb
