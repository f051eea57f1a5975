#include "sim/world/pose_track.hpp"

namespace tricoil::sim {

PoseTrack::PoseTrack(const Motion& motion, double start_s, double sample_s)
    : motion_(motion), start_s_(start_s), sample_s_(sample_s), base_(-1) {
    for (int i = 0; i < 4; ++i) {
        knots_[static_cast<std::size_t>(i)] = knot(base_ - 1 + i);
    }
}

PoseTrack::Point PoseTrack::knot(int index) const {
    const Pose pose = motion_.at(start_s_ + index * kStride * sample_s_);
    Point point;
    point << pose.position_m, pose.q_source_sensor.coeffs();
    return point;
}

Pose PoseTrack::at(int n) {
    while (n >= (base_ + 1) * kStride) {
        ++base_;
        knots_ = {knots_[1], knots_[2], knots_[3], knot(base_ + 2)};
    }
    // q and -q are the same attitude: all four knots get the sign of the second knot.
    const double t = static_cast<double>(n - base_ * kStride) / kStride;
    const std::array<double, 4> weights{-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
                                        (t + 1) * t * (t - 1) / 6};
    Point point = Point::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
        const double sign = knots_[i].tail<4>().dot(knots_[1].tail<4>()) < 0 ? -1 : 1;
        point.head<3>() += weights[i] * knots_[i].head<3>();
        point.tail<4>() += sign * weights[i] * knots_[i].tail<4>();
    }
    return {point.head<3>(), Quat<double>(point.tail<4>()).normalized()};
}

}  // namespace tricoil::sim
