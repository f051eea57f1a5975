// Why a run cannot go on: the firmware did what hardware answers with a fault, or what this model does not have.
#pragma once

#include <stdexcept>
#include <string>

namespace tricoil::virtual_board {

/// Thrown by peripherals without a place; the machine adds pc and symbol on its way out.
class RunFailure : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace tricoil::virtual_board
