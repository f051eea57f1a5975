// End of a run: the firmware caused a hardware fault or used something outside this model.
#pragma once

#include <stdexcept>

namespace tricoil::virtual_board {

/// Peripherals throw it without the pc. The processor adds the pc; the program adds the function name.
class RunFailure : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace tricoil::virtual_board
