// tricoil evaluate --dynamic: compares a recorded pose stream with a reference.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tricoil::host {

struct DynamicOptions {
    std::vector<std::string> files;  // reference, then tracker
    std::optional<double> time_offset_s;
    std::string out;  // folder for CSV and picture; empty: none
    bool json = false;
};

/// Prints the report and returns the exit code. Throws InputError for invalid files.
int evaluate_dynamic(const DynamicOptions& options);

}  // namespace tricoil::host
