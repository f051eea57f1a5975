// Updates of a simulated motion as CSV.
#pragma once

#include <string>
#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {

/// One line per update: time, measured and predicted errors; angles without whole turns. Throws like
/// write_whole_file().
void write_error_csv(const std::string& path, const std::vector<paper::Update>& updates);

/// Returns the same text.
std::string error_csv(const std::vector<paper::Update>& updates);

/// Time, measured and predicted error of the azimuth rate (24): the data of the paper's Fig. 4.
std::string azimuth_rate_csv(const std::vector<paper::Update>& updates);

}  // namespace tricoil::host
