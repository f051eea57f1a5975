// Updates of a simulated motion as CSV.
#pragma once

#include <string>
#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {

/// One line per update: time, measured and predicted errors; angles without whole turns. Throws like
/// write_whole_file().
void write_error_csv(const std::string& path, const std::vector<paper::Update>& updates);

}  // namespace tricoil::host
