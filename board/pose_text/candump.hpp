// Poses as lines of candump's log format.
#pragma once

#include <string>

#include "core/protocol/messages.hpp"

namespace tricoil::host {

/// As candump -L writes it: (time) interface ID##FDATA, F: the bit rate is switched. With its end.
std::string candump_line(const protocol::PoseMessage& pose);

}  // namespace tricoil::host
