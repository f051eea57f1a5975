// Parses faults of the simulated world.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "sim/world/fault.hpp"

namespace tricoil::host {

/// NAME[:ARG[,ARG...]][@BEGIN[-END]]
struct FaultWords {
    std::string name;
    std::vector<std::string> arguments;
    double begin_s = 0;
    double end_s = std::numeric_limits<double>::infinity();
};
/// Throws InputError for times that are not numbers or out of order.
FaultWords split_fault(const std::string& text);

/// Throws InputError with the text of the fault.
[[noreturn]] void refuse_fault(const std::string& text, const std::string& what);

/// Fault names, in the order of sim::FaultKind.
const std::vector<std::string>& fault_names();

/// For example "open_coil:S2@1.0-1.5" or "metal:0.6,0.2,0,0.05". Throws InputError for an unknown name (with the known names),
/// wrong arguments, or times out of order.
sim::Fault parse_fault(const std::string& text);

}  // namespace tricoil::host
