// Where this board keeps what one run leaves to the next.
#pragma once

#include "drivers/stm32g4/processor.hpp"

namespace tricoil::nucleo_g474re {

extern stm32g4::BootRecord boot_record;

}  // namespace tricoil::nucleo_g474re
