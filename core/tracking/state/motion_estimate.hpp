// Velocity and angular rate of the sensor from its poses.
#pragma once

#include <array>
#include <optional>
#include <utility>

#include "core/base/time.hpp"
#include "core/error_model/motion_state.hpp"
#include "core/geometry/rotations.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::tracking {

template <typename Scalar>
struct TimedPose {
    DeviceTime time{};
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();
    bool used = false;
};

/// Motion at the pose `now`, from its difference to the pose `before`. Accelerations are zero. Empty if there is no pose before,
/// or it is older than `longest`. Not inlined, to save flash.
template <typename Scalar>
[[gnu::noinline]] std::optional<error_model::MotionState<Scalar>> motion_between(const TimedPose<Scalar>& before,
                                                                                 const TimedPose<Scalar>& now,
                                                                                 Microseconds longest) {
    const Microseconds step = now.time - before.time;
    if (!before.used || step <= Microseconds{0} || step > longest) {
        return std::nullopt;
    }
    const Scalar per_second = 1 / seconds_as<Scalar>(step);
    error_model::MotionState<Scalar> state;
    state.position_m = now.position_m;
    state.q_source_sensor = now.q_source_sensor;
    state.velocity_m_s = per_second * (now.position_m - before.position_m);
    const Quat<Scalar> turn = now.q_source_sensor * before.q_source_sensor.conjugate();
    state.angular_rate_rad_s = per_second * geometry::quaternion_to_rotation_vector(turn);
    return state;
}

/// Velocity and angular rate from the difference to the pose one column frame earlier. In TDM both poses end on the same
/// excitation state, so the skew error, which depends on the order of states, cancels. The noise is that of two poses over one
/// frame.
template <typename Scalar>
class MotionEstimate {
public:
    /// poses_per_frame: three in TDM, where every column gives a pose; one in FDM.
    explicit MotionEstimate(int poses_per_frame) : poses_per_frame_(static_cast<std::size_t>(poses_per_frame)) {}

    /// Adds a pose. Returns the motion at this pose, or nullopt if the pose one frame earlier is missing or older than
    /// longest_frame.
    std::optional<error_model::MotionState<Scalar>> add(DeviceTime time, const Vec3<Scalar>& position_m,
                                                        const Quat<Scalar>& q_source_sensor, Microseconds longest_frame) {
        TimedPose<Scalar>& last = poses_[next_++ % poses_per_frame_];
        const TimedPose<Scalar> before = std::exchange(last, {time, position_m, q_source_sensor, true});
        return motion_between(before, last, longest_frame);
    }

    void clear() { poses_ = {}; }

private:
    std::size_t poses_per_frame_;
    std::array<TimedPose<Scalar>, kSourceCoils> poses_{};
    std::size_t next_ = 0;
};

}  // namespace tricoil::tracking
