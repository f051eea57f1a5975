// Output format of poses: coordinate frame, unit and Euler angles. The tracker itself uses metres and quaternions.
#pragma once

#include <string>
#include <vector>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/tool_tip.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::host {

struct OutputOptions {
    std::vector<std::string> tips;  // texts of --tip (ToolTips)
    std::vector<double>
        align_points;        // origin, point on the x axis, point towards y: nine numbers, m, source frame; empty: source frame
    int relative_to = 0;     // number of the reference sensor, from 1; 0: the source frame
    bool boresight = false;  // the attitude of the first valid pose of each sensor reads zero
    std::string unit = "m";  // m, mm, cm or in
    std::string euler;       // order of axes, for example zyx; empty: no angles
};

struct OutputFormat {
    ToolTips tips;
    tracking::OutputFrame<double> frame;  // of the tip
    PoseUnits units;
};

/// Throws InputError, naming the option, for an invalid number, coordinate frame, unit or order of axes.
OutputFormat make_output_format(const OutputOptions& options);

}  // namespace tricoil::host
