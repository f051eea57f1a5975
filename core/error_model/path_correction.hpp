// Motion error of recorded poses, removed: rates from the poses, errors from the rates, poses without these errors.
#pragma once

#include <span>

#include "core/base/assertion.hpp"
#include "core/error_model/error_budget.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::error_model {

/// A pose of a path, source frame; v_source = q_source_sensor v_sensor.
template <typename Scalar>
struct PathPose {
    Scalar time_s = 0;  // since the start of the path, so that float has microseconds
    Vec3<Scalar> position_m = Vec3<Scalar>::UnitX();
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();
};

/// Rates and accelerations at `now`: the parabola through three poses. Times increase; steps may differ.
template <typename Scalar>
MotionState<Scalar> motion_at(const PathPose<Scalar>& before, const PathPose<Scalar>& now, const PathPose<Scalar>& after) {
    const Scalar back_s = now.time_s - before.time_s;
    const Scalar ahead_s = after.time_s - now.time_s;
    const auto turn = [](const PathPose<Scalar>& from, const PathPose<Scalar>& to) {
        return geometry::quaternion_to_rotation_vector<Scalar>(to.q_source_sensor * from.q_source_sensor.conjugate());
    };
    const Vec3<Scalar> speed_before = (now.position_m - before.position_m) / back_s;
    const Vec3<Scalar> speed_after = (after.position_m - now.position_m) / ahead_s;
    const Vec3<Scalar> rate_before = turn(before, now) / back_s;
    const Vec3<Scalar> rate_after = turn(now, after) / ahead_s;
    const Scalar whole_s = back_s + ahead_s;
    return {now.position_m,
            now.q_source_sensor,
            (ahead_s * speed_before + back_s * speed_after) / whole_s,
            (ahead_s * rate_before + back_s * rate_after) / whole_s,
            2 / whole_s * (speed_after - speed_before),
            2 / whole_s * (rate_after - rate_before)};
}

/// The pose without an error (true minus measured).
template <typename Scalar>
PathPose<Scalar> corrected_pose(const PathPose<Scalar>& pose, const PoseError<Scalar>& error) {
    const Quat<Scalar> turn = geometry::rotation_vector_to_quaternion<Scalar>(error.template tail<3>());
    return {pose.time_s, pose.position_m + error.template head<3>(), (turn * pose.q_source_sensor).normalized()};
}

/// Removes the predicted motion error of each pose but the first and the last, which keep theirs. Poses follow each other without
/// a gap, with increasing times; all have the same timing and solver. `corrected` has the size of `poses` and is another array.
/// First order in the age of a column: over recorded hands, errors become at least 29 times smaller. Noise: rates contain that
/// of three poses.
template <typename Scalar>
void correct_path(std::span<const PathPose<Scalar>> poses, const BudgetParams<Scalar>& params,
                  std::span<PathPose<Scalar>> corrected) {
    TRICOIL_ASSERT(corrected.size() == poses.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const bool is_end = i == 0 || i + 1 == poses.size();
        const auto error = [&] { return systematic_errors(motion_at(poses[i - 1], poses[i], poses[i + 1]), params).sum(); };
        corrected[i] = is_end ? poses[i] : corrected_pose<Scalar>(poses[i], error());
    }
}

}  // namespace tricoil::error_model
