// The updates of a simulated motion as a table.
#pragma once

#include <string>
#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {

/// One line per update: time, measured and predicted errors; angles without whole turns. Written beside the target and renamed,
/// so that a failure leaves nothing half-written. Throws InputError if the file cannot be written.
void write_error_csv(const std::string& path, const std::vector<paper::Update>& updates);

/// The same text, without a file.
std::string error_csv(const std::vector<paper::Update>& updates);

}  // namespace tricoil::host
