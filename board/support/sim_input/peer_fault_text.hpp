// Faults of a simulated peer as a person types them.
#pragma once

#include <string>

#include "sim/front_end/peer_fault.hpp"

namespace tricoil::host {

/// Reads NAME@FIRST-LAST, or NAME@N. Throws InputError that names what is wrong with `text`.
sim::PeerFault parse_peer_fault(const std::string& text);

}  // namespace tricoil::host
