// Bit rates of the CAN bus as text.
#pragma once

#include <string>

#include "sim/virtual_board/links/can_wire.hpp"

namespace tricoil::virtual_board {

/// NOMINAL or NOMINAL/DATA in bit/s; without DATA both phases have the same rate. Throws host::InputError.
CanWire::Rates parse_can_rate(const std::string& text);

}  // namespace tricoil::virtual_board
