// tricoil evaluate --dynamic: a recorded pose stream against a reference's.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tricoil::host {

struct DynamicOptions {
    std::vector<std::string> files;  // the reference's, then the tracker's
    std::optional<double> time_offset_s;
    std::string out;  // folder for CSV and picture; empty: none
    bool json = false;
};

/// Prints the report; an exit code. Throws InputError as the parts do.
int evaluate_dynamic(const DynamicOptions& options);

}  // namespace tricoil::host
