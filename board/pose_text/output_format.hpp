// How poses are written: in which frame, unit and angles. The tracker itself knows metres and quaternions only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/euler_order.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::host {

struct OutputOptions {
    std::vector<double> tip_m;  // x, y, z in the sensor frame; empty: the sensor itself
    std::vector<double>
        align_points;        // origin, a point on the x axis, one towards y: nine numbers, m, source frame; empty: source
    bool boresight = false;  // the first valid pose's attitude reads zero
    std::string unit = "m";  // m, mm, cm or in
    std::string euler;       // as zyx; empty: no angles
};

struct OutputFormat {
    tracking::OutputFrame<double> frame;
    bool boresight_first = false;
    std::string unit = "m";
    double units_per_m = 1;
    std::string euler_name;
    std::optional<geometry::AxisOrder> euler;
};

/// Throws InputError that names the option for what is no number, no frame, no unit or no order of axes.
OutputFormat make_output_format(const OutputOptions& options);

}  // namespace tricoil::host
