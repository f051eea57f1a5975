// List of the virtual board's registers.
#pragma once

#include <string>

#include "sim/world/scenario.hpp"

namespace tricoil::virtual_board {

/// A Markdown table: peripheral, register, address, reset value, modelled bits, refused fields.
std::string register_list(const sim::Scenario& scenario);

}  // namespace tricoil::virtual_board
