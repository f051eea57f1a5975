// Poses in compact form, for the plots of the live page and for playback.
#pragma once

#include <array>
#include <string>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::web {

/// True if position, attitude and covariance are finite. Other poses have no compact form.
bool is_finite(const tracking::PoseEstimate<double>& pose);

/// Names of the numbers of a pose: time of the device (us) and in UTC (ms), position in m, quaternion, covariance of the position
/// in m^2, predicted error in mm (null if unknown), distortion in mm, signal-to-noise ratio.
constexpr std::array kCompactColumns{
    "sensor", "time_us", "utc_ms", "flags",    "state",         "x",     "y", "z", "qw", "qx", "qy", "qz", "cxx", "cxy", "cxz",
    "cyy",    "cyz",     "czz",    "error_mm", "distortion_mm", "snr_db"};

/// Appends the numbers as a JSON array.
void put_compact(const ServedPose& served, std::string& out);

}  // namespace tricoil::host::web
