// Interface between the family's start-up code and a board.
#pragma once

#include "board/cortex_m/vectors.hpp"
#include "drivers/stm32g4/boot_record.hpp"

extern "C" [[noreturn]] void fault_handler();

namespace tricoil::stm32g4_board {

/// All interrupts of the STM32G4 (RM0440 table 97). A board, or tracker_vectors.cpp, defines the vectors in section ".vectors".
using Vectors = board::Vectors<102>;

/// Unexpected exceptions and interrupts are faults.
consteval Vectors fault_vectors() { return board::make_vectors<102>(fault_handler); }

/// Kept through a reset.
extern stm32g4::BootRecord boot_record;

/// Defined by the board: switches all outputs off. It runs in fault handlers: no objects, little stack, and possibly only the
/// clock of the GPIO port.
void switch_outputs_off();

}  // namespace tricoil::stm32g4_board
