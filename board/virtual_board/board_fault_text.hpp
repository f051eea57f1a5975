// Text form of the virtual board's faults: NAME[:NUMBER][@BEGIN[-END]].
#pragma once

#include <string>
#include <vector>

#include "sim/virtual_board/board_fault.hpp"

namespace tricoil::virtual_board {

std::vector<std::string> board_fault_names();
[[nodiscard]] bool is_board_fault(const std::string& text);
/// Throws host::InputError for an unknown name, number or time.
BoardFault parse_board_fault(const std::string& text);

}  // namespace tricoil::virtual_board
