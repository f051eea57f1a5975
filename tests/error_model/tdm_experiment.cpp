#include "tests/error_model/tdm_experiment.hpp"

#include <fmt/format.h>

#include <cmath>
#include <deque>
#include <stdexcept>

#include "core/error_model/path_correction.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::paper {
namespace {

using error_model::MotionState;
using error_model::PoseError;
using sim::Pose;

constexpr double kCoupling = 1;

/// Rotation (rad, source frame) from attitude `from` to attitude `to`: to = exp(r) from.
Vec3<double> rotation_between(const Quat<double>& from, const Quat<double>& to) {
    return geometry::quaternion_to_rotation_vector<double>(to * from.conjugate());
}

MotionState<double> state_from(const Pose& pose, const Pose& before, double step_s) {
    MotionState<double> state;
    state.position_m = pose.position_m;
    state.q_source_sensor = pose.q_source_sensor;
    state.velocity_m_s = (pose.position_m - before.position_m) / step_s;
    state.angular_rate_rad_s = rotation_between(before.q_source_sensor, pose.q_source_sensor) / step_s;
    return state;
}

Vec3<double> column(const Pose& pose, int j) {
    const Mat3<double> o = geometry::attitude_matrix(pose.q_source_sensor);
    return field::signal_matrix<double>(kCoupling, pose.position_m, o).col(j);
}

/// The direct solution in the true hemisphere.
Pose solve(const Mat3<double>& x, const Vec3<double>& true_position_m) {
    const auto solution = solver::solve_direct(x, kCoupling);
    if (!solution.ok()) {
        throw std::invalid_argument(fmt::format("TDM experiment: {}", solution.status().message()));
    }
    return {solution->position_towards(true_position_m), geometry::attitude_quaternion(solution->attitude)};
}

}  // namespace

MotionState<double> motion_state(const sim::Motion& motion, double time_s) {
    const auto at = [&](double when_s) {
        const Pose pose = motion.at(when_s);
        return error_model::PathPose<double>{when_s, pose.position_m, pose.q_source_sensor};
    };
    constexpr double kStep = 1e-4;
    return error_model::motion_at(at(time_s - kStep), at(time_s), at(time_s + kStep));
}

std::vector<TdmPose> simulate_tdm(const sim::Motion& motion, const TdmParams& params) {
    const auto slots = static_cast<int>(params.duration_s / params.slot_s);
    Mat3<double> x = Mat3<double>::Zero();
    std::deque<Pose> solved;  // newest poses, up to three slots back: the skew error has a period of three slots
    std::vector<TdmPose> poses;
    for (int n = 0; n < slots; ++n) {
        const double time_s = n * params.slot_s;
        const Pose truth = motion.at(time_s);
        x.col(n % 3) = column(truth, n % 3);
        if (n < 2) {
            continue;
        }
        const Pose measured = solve(x, truth.position_m);
        solved.push_back(measured);
        const double range = truth.position_m.norm();
        const bool scored = time_s >= params.settle_s && range >= params.min_range_m && range <= params.max_range_m;
        if (solved.size() > 3 && scored) {
            error_model::BudgetParams<double> budget;
            budget.timing = error_model::tdm_timing<double>(params.slot_s, 0, static_cast<error_model::LastState>(n % 3));
            TdmPose pose;
            pose.time_s = time_s;
            pose.measured << truth.position_m - measured.position_m,
                rotation_between(measured.q_source_sensor, truth.q_source_sensor);
            pose.predicted = error_model::systematic_errors(motion_state(motion, time_s), budget).sum();
            const auto own_state = state_from(measured, solved.front(), 3 * params.slot_s);
            pose.predicted_by_device = error_model::systematic_errors(own_state, budget).sum();
            poses.push_back(pose);
        }
        if (solved.size() > 3) {
            solved.pop_front();
        }
    }
    if (poses.empty()) {
        throw std::invalid_argument(
            fmt::format("TDM experiment: no pose to score; the motion must last longer than {} s and come within "
                        "{} to {} m",
                        params.settle_s, params.min_range_m, params.max_range_m));
    }
    return poses;
}

}  // namespace tricoil::paper
