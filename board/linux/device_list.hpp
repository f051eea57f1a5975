// CAN interfaces and USB devices of this machine.
#pragma once

#include "board/support/json_text.hpp"

namespace tricoil::linux_board {

/// Array of objects: uri; of a CAN interface also fd, of a USB device also product. Throws DeviceError.
host::Json connected_devices();

}  // namespace tricoil::linux_board
