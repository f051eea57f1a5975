// Report of a finished run as text and as JSON.
#pragma once

#include <string>

#include "board/host/run/simulated_run.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

/// Summary and assumptions. Lengths are in metres; the keys state the units of angles.
Json run_result(const RunReport& report);

/// Summary text of a few lines from run_result().
std::string run_text(const Json& result);

}  // namespace tricoil::host
