// Parses faults of the simulated world.
#pragma once

#include <string>
#include <vector>

#include "sim/world/fault.hpp"

namespace tricoil::host {

/// Fault names, in the order of sim::FaultKind.
const std::vector<std::string>& fault_names();

/// Parses NAME[:ARG[,ARG...]][@BEGIN[-END]], for example "open_coil:S2@1.0-1.5" or "metal:0.6,0.2,0,0.05". Throws InputError for
/// an unknown name (with the known names), wrong arguments, or times out of order.
sim::Fault parse_fault(const std::string& text);

}  // namespace tricoil::host
