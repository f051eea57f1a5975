// Velocity and angular rate of the sensor from its poses, for the error budget.
#pragma once

#include <array>
#include <optional>

#include "core/base/time.hpp"
#include "core/error_model/motion_state.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::tracking {

/// Velocity and angular rate from the difference to the pose one column frame earlier. In TDM both poses end on the same
/// excitation state, so the skew error, which depends on the order of states, cancels. The noise is that of two poses over one
/// frame. Accelerations are zero. kMost: largest poses_per_frame.
template <typename Scalar, std::size_t kMost = 3>
class MotionEstimate {
public:
    /// poses_per_frame: three in TDM, where every column gives a pose; one in FDM and for poses of separate frames.
    explicit MotionEstimate(int poses_per_frame) : poses_per_frame_(static_cast<std::size_t>(poses_per_frame)) {}

    /// Adds a pose. Returns the motion at this pose, or nullopt if the pose one frame earlier is missing or older than
    /// longest_frame.
    std::optional<error_model::MotionState<Scalar>> add(DeviceTime time, const Vec3<Scalar>& position_m,
                                                        const Quat<Scalar>& q_source_sensor, Microseconds longest_frame) {
        const Entry before = entries_[next_ % poses_per_frame_];
        entries_[next_ % poses_per_frame_] = {time, position_m, q_source_sensor, true};
        ++next_;
        const Microseconds step = time - before.time;
        if (!before.used || step <= Microseconds{0} || step > longest_frame) {
            return std::nullopt;
        }
        const Scalar per_second = 1 / seconds_as<Scalar>(step);
        error_model::MotionState<Scalar> state;
        state.position_m = position_m;
        state.q_source_sensor = q_source_sensor;
        state.velocity_m_s = per_second * (position_m - before.position_m);
        const Quat<Scalar> turn = q_source_sensor * before.q_source_sensor.conjugate();
        state.angular_rate_rad_s = per_second * geometry::quaternion_to_rotation_vector(turn);
        return state;
    }

    /// Forgets all poses, because later poses are not continuous with them.
    void clear() { entries_ = {}; }

private:
    struct Entry {
        DeviceTime time{};
        Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
        Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();
        bool used = false;
    };
    std::size_t poses_per_frame_;
    std::array<Entry, kMost> entries_{};
    std::size_t next_ = 0;
};

}  // namespace tricoil::tracking
