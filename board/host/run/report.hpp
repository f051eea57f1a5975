// A finished run in words and as JSON.
#pragma once

#include <string>

#include "board/host/run/simulated_run.hpp"

namespace tricoil::host {

/// A summary of a few lines, for people.
std::string summary_text(const RunReport& report);

/// The same and what was assumed, for programs. Lengths in metres, angles as the key says.
std::string summary_json(const RunReport& report);

}  // namespace tricoil::host
