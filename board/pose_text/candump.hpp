// Poses in candump log format.
#pragma once

#include <string>

#include "core/protocol/messages.hpp"

namespace tricoil::host {

/// One line of candump -L, with line feed: (time) interface ID##FDATA. F: flags, here CAN FD with bit rate switch.
std::string candump_line(const protocol::PoseMessage& pose);

}  // namespace tricoil::host
