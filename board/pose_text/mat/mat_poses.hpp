// Poses as a MAT file, for MATLAB and Octave.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "board/pose_text/pose_fields.hpp"

namespace tricoil::host {

/// Variables: `poses`, a structure whose fields have one row for each pose and the names of the JSON keys, and also covariance
/// (6 x 6 x N: position in m, then small rotation in rad) and couplings (3 x 3 x N: sensor coil, source coil); `flag_names`:
/// names of the bits of poses.flags. MAT version 5, without compression.
class MatPoses {
public:
    explicit MatPoses(PoseUnits units) : units_(std::move(units)) {}

    /// Keeps the pose in memory. Throws InputError if the file becomes too large for its format.
    void add(const tracking::PoseEstimate<double>& pose);

    /// Passes the file to `put`. Throws DeviceError if the library fails.
    void finish(const std::function<void(std::string_view)>& put) const;

private:
    PoseUnits units_;
    std::vector<tracking::PoseEstimate<double>> poses_;
};

}  // namespace tricoil::host
