// Report of a finished run as text and as JSON.
#pragma once

#include <string>

#include "board/host/run/simulated_run.hpp"

namespace tricoil::host {

/// Summary text of a few lines.
std::string summary_text(const RunReport& report);

/// Summary and assumptions as JSON. Lengths are in metres; the keys state the units of angles.
std::string summary_json(const RunReport& report);

}  // namespace tricoil::host
