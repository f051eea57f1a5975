// Memory that is kept through a reset.
#pragma once

#include "drivers/stm32g4/boot_record.hpp"

namespace tricoil::stm32g4_board {

extern stm32g4::BootRecord boot_record;

}  // namespace tricoil::stm32g4_board
