// Interface between the family's start-up code and a board.
#pragma once

#include "board/cortex_m/vectors.hpp"

extern "C" [[noreturn]] void fault_handler();

namespace tricoil::stm32g4_board {

/// All interrupts of the STM32G4 (RM0440 table 97). A board, or tracker_vectors.cpp, defines one in section ".vectors".
using Vectors = board::Vectors<102>;

/// Unexpected exceptions and interrupts are faults.
consteval Vectors fault_vectors() { return board::make_vectors<102>(fault_handler); }

/// Defined by the board: switches off whatever it drives. Runs in fault handlers: without objects, with little stack, and before
/// any clock but the port's is known to be on.
void switch_outputs_off();

}  // namespace tricoil::stm32g4_board
