// Parses faults of a simulated peer.
#pragma once

#include <string>

#include "sim/front_end/peer_fault.hpp"

namespace tricoil::host {

/// Parses NAME@FIRST-LAST or NAME@N. Throws InputError that names the error in `text`.
sim::PeerFault parse_peer_fault(const std::string& text);

}  // namespace tricoil::host
