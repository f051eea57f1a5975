// Recorded pose stream, with interpolation between samples.
#pragma once

#include <string>
#include <vector>

#include "core/linear/quaternion.hpp"

namespace tricoil::host {

struct TimedPose {
    double time_s = 0;
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q = Quat<double>::Identity();
};

/// Pose with rates and accelerations, in the coordinate frame of the stream.
struct MovingPose {
    TimedPose pose;
    Vec3<double> rate_rad_s = Vec3<double>::Zero();
    Vec3<double> angular_acceleration_rad_s2 = Vec3<double>::Zero();
    Vec3<double> velocity_m_s = Vec3<double>::Zero();
    Vec3<double> acceleration_m_s2 = Vec3<double>::Zero();
};

/// Samples in time order. Consecutive quaternions have a positive scalar product.
class PoseStream {
public:
    /// Reads a PoseTable with time_us or time_s. Lines with valid = 0 and other columns are ignored. Throws InputError, naming
    /// file and line: missing columns, invalid numbers, time that does not increase, a quaternion far from unit length, a
    /// position beyond 1 km, fewer than 20 poses.
    static PoseStream read(const std::string& path);

    /// From poses in time order. Throws InputError like read(); `name`: for messages.
    PoseStream(std::vector<TimedPose> poses, const std::string& name);

    [[nodiscard]] const std::vector<TimedPose>& poses() const { return poses_; }
    [[nodiscard]] double begin_s() const { return poses_.front().time_s; }
    [[nodiscard]] double end_s() const { return poses_.back().time_s; }

    /// True if `time_s` is between two samples that are at most 4 median sample intervals apart.
    [[nodiscard]] bool covers(double time_s) const;

    /// Position by cubic interpolation, attitude by spherical interpolation. Clamped to the ends of the stream.
    [[nodiscard]] MovingPose at(double time_s) const;

private:
    [[nodiscard]] std::size_t interval_of(double time_s) const;
    std::vector<TimedPose> poses_;
    double longest_interval_s_ = 0;  // longest interval that is not a gap
};

}  // namespace tricoil::host
