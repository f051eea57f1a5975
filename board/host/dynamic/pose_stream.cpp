#include "board/host/dynamic/pose_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "board/pose_text/pose_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "core/geometry/quaternion_sign.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMinPoses = 20;
constexpr double kFarthest_m = 1000;
constexpr double kGap = 4;  // a longer pause is a gap, in median sample intervals

}  // namespace

PoseStream PoseStream::read(const std::string& path) {
    Table rows(path);
    PoseTable table(rows);
    const bool has_us = table.has("time_us");
    refuse_if(!has_us && !table.has("time_s"), "{}:1: no column time_us or time_s in the header", path);
    std::vector<TimedPose> poses;
    while (table.next()) {
        if (table.number("valid", 1) == 0) {
            continue;
        }
        const double time_s = has_us ? 1e-6 * table.number("time_us") : table.number("time_s");
        poses.push_back({time_s, table.position_m(), table.attitude()});
        if (const double farthest_m = poses.back().position_m.cwiseAbs().maxCoeff(); !(farthest_m <= kFarthest_m)) {
            throw InputError(fmt::format("{}: position {:g} m away; is its unit right?", table.where(), farthest_m));
        }
        if (poses.size() > 1 && !(time_s > poses[poses.size() - 2].time_s)) {
            throw InputError(table.where() + ": time does not increase");
        }
    }
    return {std::move(poses), path};
}

PoseStream::PoseStream(std::vector<TimedPose> poses, const std::string& name) : poses_(std::move(poses)) {
    refuse_if(poses_.size() < kMinPoses, "{}: {} valid poses; at least {} are needed", name, poses_.size(), kMinPoses);
    for (std::size_t n = 1; n < poses_.size(); ++n) {
        poses_[n].q = geometry::with_sign_of(poses_[n].q, poses_[n - 1].q);
    }
    std::vector<double> intervals;
    for (std::size_t n = 1; n < poses_.size(); ++n) {
        intervals.push_back(poses_[n].time_s - poses_[n - 1].time_s);
    }
    longest_interval_s_ = kGap * median(std::move(intervals));
}

/// Index of the last sample at or before `time_s`, but at least the first and at most the last but one.
std::size_t PoseStream::interval_of(double time_s) const {
    const auto after =
        std::upper_bound(poses_.begin(), poses_.end(), time_s, [](double t, const auto& p) { return t < p.time_s; });
    const auto last = static_cast<std::ptrdiff_t>(poses_.size()) - 2;
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - poses_.begin() - 1, 0, last));
}

bool PoseStream::covers(double time_s) const {
    const std::size_t i = interval_of(time_s);
    return time_s >= begin_s() && time_s <= end_s() && poses_[i + 1].time_s - poses_[i].time_s <= longest_interval_s_;
}

MovingPose PoseStream::at(double time_s) const {
    const std::size_t i = interval_of(time_s);
    const TimedPose& a = poses_[i];
    const TimedPose& b = poses_[i + 1];
    const double h = b.time_s - a.time_s;
    const double s = std::clamp((time_s - a.time_s) / h, 0.0, 1.0);
    const auto slope = [this](std::size_t n) -> Vec3<double> {
        const std::size_t from = n == 0 ? 0 : n - 1;
        const std::size_t to = std::min(n + 1, poses_.size() - 1);
        return (poses_[to].position_m - poses_[from].position_m) / (poses_[to].time_s - poses_[from].time_s);
    };
    // Cubic Hermite interpolation; slopes are central differences.
    const Vec3<double> va = h * slope(i);
    const Vec3<double> vb = h * slope(i + 1);
    const Vec3<double> d = b.position_m - a.position_m;
    const Vec3<double> c2 = 3 * d - 2 * va - vb;
    const Vec3<double> c3 = va + vb - 2 * d;
    MovingPose result;
    result.pose.time_s = time_s;
    result.pose.position_m = a.position_m + s * (va + s * (c2 + s * c3));
    result.pose.q = a.q.slerp(s, b.q);
    const auto rate = [this](std::size_t n) -> Vec3<double> {
        return geometry::quaternion_to_rotation_vector<double>(poses_[n + 1].q * poses_[n].q.conjugate()) /
               (poses_[n + 1].time_s - poses_[n].time_s);
    };
    const std::size_t before = i == 0 ? 0 : i - 1;
    const std::size_t behind = std::min(i + 1, poses_.size() - 2);
    const double apart_s =
        (poses_[behind].time_s + poses_[behind + 1].time_s - poses_[before].time_s - poses_[before + 1].time_s) / 2;
    result.angular_acceleration_rad_s2 = (rate(behind) - rate(before)) / apart_s;
    result.rate_rad_s = rate(i) + (s - 0.5) * h * result.angular_acceleration_rad_s2;
    result.velocity_m_s = (va + s * (2 * c2 + 3 * s * c3)) / h;
    result.acceleration_m_s2 = (2 * c2 + 6 * s * c3) / (h * h);
    return result;
}

}  // namespace tricoil::host
