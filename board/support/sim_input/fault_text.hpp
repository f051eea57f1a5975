// Faults of the simulated world as a person types them.
#pragma once

#include <string>
#include <vector>

#include "sim/world/fault.hpp"

namespace tricoil::host {

/// The names, in the order of sim::FaultKind.
const std::vector<std::string>& fault_names();

/// Reads NAME[:ARG[,ARG...]][@BEGIN[-END]], for instance "open_coil:S2@1.0-1.5" or "metal:0.6,0.2,0,0.05". Throws InputError for
/// an unknown name (with the names there are), wrong arguments, or times out of order.
sim::Fault parse_fault(const std::string& text);

}  // namespace tricoil::host
