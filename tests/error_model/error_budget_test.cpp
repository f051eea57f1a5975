// Every term of the error budget against a simulation of that effect alone.
#include "core/error_model/error_budget.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error_model/step_error.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/previous_measurement.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/error_model/tdm_experiment.hpp"
#include "tests/error_model/tdm_report.hpp"
#include "tests/support/approx.hpp"

namespace tricoil::error_model {
namespace {

constexpr double kCoupling = 1;
constexpr double kUpdate = 1.0 / 240;
constexpr std::uint64_t kSeed = 5;

Mat3<double> signal_matrix(const sim::Pose& pose) {
    return field::signal_matrix<double>(kCoupling, pose.position_m, geometry::attitude_matrix(pose.q_source_sensor));
}

PoseError<double> difference(const sim::Pose& real, const Vec3<double>& position_m, const Mat3<double>& attitude) {
    const Quat<double> measured = geometry::attitude_quaternion(attitude);
    PoseError<double> error;
    error << real.position_m - position_m,
        geometry::quaternion_to_rotation_vector<double>(real.q_source_sensor * measured.conjugate());
    return error;
}

struct SumOfSquares {
    double measured = 0;
    double residual = 0;
    void include(const PoseError<double>& m, const PoseError<double>& p) {
        measured += m.squaredNorm();
        residual += (m - p).squaredNorm();
    }
    [[nodiscard]] double unexplained() const { return std::sqrt(residual / measured); }
};

/// The matrix is averaged over the window and solved: the budget predicts the error up to the next order.
TEST(Budget, BlurEqualsTheErrorOfAveraging) {
    const sim::HandMotion motion({0.6, 0.1, -0.2}, kSeed);
    const double window_s = 1.0 / 240;
    SumOfSquares sum;
    for (double t = 0.5; t < 3; t += 0.037) {
        Mat3<double> x = Mat3<double>::Zero();
        constexpr int kParts = 400;
        for (int n = 0; n < kParts; ++n) {
            x += signal_matrix(motion.at(t + ((n + 0.5) / kParts - 0.5) * window_s)) / kParts;
        }
        const auto s = solver::solve_direct(x, kCoupling);
        ASSERT_TRUE(s.ok());
        const double sign = s->direction.x() < 0 ? -1 : 1;
        const auto measured = difference(motion.at(t), sign * s->range_m * s->direction, s->attitude);
        const auto state = paper::motion_state(motion, t);
        sum.include(measured, blur_error(state, window_s));
    }
    EXPECT_LT(sum.unexplained(), 0.01);
}

TEST(Budget, LatencyEqualsTheMotionDuringIt) {
    MotionState<double> state;
    state.velocity_m_s << 1, 2, 3;
    state.angular_rate_rad_s << 0.1, 0.2, 0.3;
    const auto error = latency_error(state, 0.01);
    EXPECT_TRUE(is_approx(error, (Vec6<double>() << 0.01, 0.02, 0.03, 0.001, 0.002, 0.003).finished()));
}

/// A closed loop of the pole-free form over a hand-like motion, no noise, no skew.
TEST(Budget, LinearizationEqualsTheErrorOfThePoleFreeLoop) {
    const sim::HandMotion motion({0.6, 0.1, -0.2}, kSeed);
    const sim::Pose start = motion.at(0);
    solver::VectorPose<double> estimate{start.position_m.norm(), start.position_m.normalized(),
                                        geometry::attitude_matrix(start.q_source_sensor)};
    SumOfSquares sum;
    for (int n = 1; n < 720; ++n) {
        const double t = n * kUpdate;
        estimate = *solver::step_vectors(signal_matrix(motion.at(t)), kCoupling, estimate);
        auto state = paper::motion_state(motion, t);
        const auto mid = paper::motion_state(motion, t - kUpdate / 2);  // the mean rates of the update
        state.velocity_m_s = mid.velocity_m_s;
        state.angular_rate_rad_s = mid.angular_rate_rad_s;
        sum.include(difference(motion.at(t), estimate.range_m * estimate.direction, estimate.attitude),
                    linearization_error(state, kUpdate, StepForm::vectors));
    }
    EXPECT_LT(sum.unexplained(), 0.05);
}

struct AngleLoopResult {
    double with_frame;     // share of the error that the budget leaves unexplained
    double without_frame;  // the same with linearization alone
};

AngleLoopResult run_angle_loop(double update_s) {
    const sim::HandMotion motion({0.4, 0.1, -0.4}, kSeed);
    const sim::Pose start = motion.at(0);
    solver::AnglePose<double> estimate{geometry::to_spherical<double>(start.position_m),
                                       geometry::to_euler(geometry::attitude_matrix(start.q_source_sensor))};
    SumOfSquares both;
    SumOfSquares linearization_alone;
    for (int n = 1; n * update_s < 3; ++n) {
        const double t = n * update_s;
        estimate = *solver::step_angles(signal_matrix(motion.at(t)), kCoupling, estimate);
        auto state = paper::motion_state(motion, t);
        const auto mid = paper::motion_state(motion, t - update_s / 2);
        state.velocity_m_s = mid.velocity_m_s;
        state.angular_rate_rad_s = mid.angular_rate_rad_s;
        const auto measured =
            difference(motion.at(t), geometry::to_cartesian(estimate.position), geometry::attitude_matrix(estimate.attitude));
        const auto linearization = linearization_error(state, update_s, StepForm::angles);
        linearization_alone.include(measured, linearization);
        both.include(measured, linearization + frame_propagation_error(state, update_s));
    }
    return {both.unexplained(), linearization_alone.unexplained()};
}

/// The same in the paper's angles, which adds frame propagation. The budget contains that term to second order in the turn, so
/// the unexplained share of the error falls at least in proportion to the update time.
TEST(Budget, FramePropagationExplainsTheAngleLoop) {
    const auto at_240 = run_angle_loop(kUpdate);
    const auto at_480 = run_angle_loop(kUpdate / 2);
    const auto at_960 = run_angle_loop(kUpdate / 4);
    EXPECT_LT(at_960.with_frame, 0.05);
    EXPECT_LT(at_480.with_frame / at_240.with_frame, 0.55);
    EXPECT_LT(at_960.with_frame / at_480.with_frame, 0.55);
    EXPECT_GT(at_960.without_frame, 0.2);
}

TEST(Budget, SkewExplainsSimultaneousSolvingOfTdm) {
    const sim::HandMotion motion({0.9, 0, 0}, kSeed);
    paper::TdmParams params;
    params.duration_s = 3;
    const auto poses = paper::simulate_tdm(motion, params);
    const auto position = paper::summarise(poses, 0);
    const auto rotation = paper::summarise(poses, 3);
    EXPECT_GT(position.measured_rms, 1e-3);
    EXPECT_NEAR(position.predicted_rms / position.measured_rms, 1, 0.05);
    EXPECT_NEAR(rotation.predicted_rms / rotation.measured_rms, 1, 0.05);
    EXPECT_GT(position.correlation, 0.99);
}

TEST(Budget, MatrixErrorIsTheResponseOfTheDirectSolver) {
    MotionState<double> state;
    state.position_m << 0.3, -0.4, 0.2;
    state.q_source_sensor = geometry::rotation_vector_to_quaternion<double>({0.4, 1.1, -0.7});
    const Mat3<double> x = field::signal_matrix<double>(1, state.position_m, geometry::attitude_matrix(state.q_source_sensor));
    Mat3<double> missing;
    missing << 1, -2, 0.5, 3, 0.2, -1, -0.7, 1.5, 2;
    missing *= 1e-6 * x.norm();
    const auto solved = solver::solve_direct<double>(x - missing, 1.0);
    const Vec3<double> found_m = solved->range_m * solved->direction;
    const double side = found_m.dot(state.position_m) < 0 ? -1 : 1;
    const Quat<double> q = geometry::attitude_quaternion(solved->attitude);
    PoseError<double> expected;
    expected << state.position_m - side * found_m,
        geometry::quaternion_to_rotation_vector<double>(state.q_source_sensor * q.conjugate());
    EXPECT_GT(expected.norm(), 1e-7);
    EXPECT_LT((matrix_error<double>(state, missing) - expected).norm(), 1e-4 * expected.norm());
}

/// The squares of systematic errors from noisy measurements contain a share of the noise already.
TEST(Budget, TotalCountsMeasuredNoiseOnce) {
    SystematicErrors<double> errors;
    errors.skew << 3e-3, 0, 0, 0, 0, 2e-3;
    const Mat6<double> covariance = 1e-6 * Mat6<double>::Identity();
    EXPECT_NEAR(budget_of(errors, covariance, 0.5).total.position_m, std::sqrt(9e-6 + 1.5e-6), 1e-12);
    EXPECT_NEAR(budget_of(errors, covariance, 0.5).total.rotation_rad, std::sqrt(4e-6 + 1.5e-6), 1e-12);
    EXPECT_NEAR(budget_of(errors, covariance, 2.0).total.position_m, 3e-3, 1e-12);
    EXPECT_NEAR(budget_of(errors, covariance, 0.5).noise.position_m, std::sqrt(3e-6), 1e-12);
}

TEST(Budget, TotalAddsSystematicTermsAsVectorsAndNoiseInSquares) {
    MotionState<double> state;
    state.position_m << 0.5, 0, 0;
    state.velocity_m_s << 0, 1, 0;
    BudgetParams<double> params;
    params.timing = tdm_timing(1.0 / 720, 1e-3);
    params.timing.latency_s = 0.002;
    params.solver = SolverForm::previous_angles;
    const auto budget = error_budget(state, 1e-3, params);
    const auto sum = systematic_errors(state, params).sum();
    EXPECT_NEAR(budget.total.position_m, std::hypot(sum.head<3>().norm(), budget.noise.position_m), 1e-12);
    EXPECT_NEAR(budget.total.rotation_rad, std::hypot(sum.tail<3>().norm(), budget.noise.rotation_rad), 1e-14);
    EXPECT_NEAR(budget.latency.position_m, 2e-3, 1e-12);
    // At 60 dB and 0.5 m the position bound is 1.06 mm.
    EXPECT_NEAR(budget.noise.position_m, 1.06e-3, 1e-5);
    // The rotation bound is sqrt(8 + 8 + 2) n for the three angles together.
    EXPECT_NEAR(budget.noise.rotation_rad, std::sqrt(18.0) * 1e-3, 1e-11);
}

TEST(Budget, DirectSolverHasNeitherLinearizationNorFrameError) {
    MotionState<double> state;
    state.velocity_m_s << 3, 2, 1;
    state.angular_rate_rad_s << 9, 8, 7;
    BudgetParams<double> params;
    params.timing = {.update_s = kUpdate, .window_s = kUpdate};  // FDM
    const auto budget = error_budget(state, 0.0, params);
    EXPECT_EQ(budget.linearization.position_m, 0);
    EXPECT_EQ(budget.frame_propagation.rotation_rad, 0);
    EXPECT_EQ(budget.skew.position_m, 0);
    EXPECT_GT(budget.blur.position_m, 0);
}

/// Each further pass approximately cubes the remaining error.
TEST(Budget, FurtherPassesReduceTheLinearizationError) {
    MotionState<double> state;
    state.position_m << 0.5, 0.2, 0.1;
    state.velocity_m_s << 1, 2, -1;
    state.angular_rate_rad_s << 4, -3, 5;
    BudgetParams<double> params;
    params.timing = {.update_s = kUpdate, .window_s = kUpdate};  // FDM
    for (const SolverForm form : {SolverForm::previous_vectors, SolverForm::previous_angles}) {
        params.solver = form;
        params.passes = 1;
        const double one_m = error_budget(state, 0.0, params).linearization.position_m;
        params.passes = 2;
        const auto two = error_budget(state, 0.0, params);
        EXPECT_GT(one_m, 0.05e-3);
        EXPECT_LT(two.linearization.position_m, 1e-3 * one_m);
        EXPECT_LT(two.frame_propagation.position_m, 1e-3 * one_m);
    }
    state.velocity_m_s << 0, 1'000, 0;
    EXPECT_TRUE(std::isnan(error_budget(state, 0.0, params).total.position_m));
}

TEST(Budget, IsNaNOutsideTheStepsDomain) {
    MotionState<double> state;
    state.velocity_m_s << 0, 1'000, 0;
    BudgetParams<double> params;
    params.timing = {.update_s = kUpdate, .window_s = kUpdate};  // FDM
    params.solver = SolverForm::previous_vectors;
    EXPECT_TRUE(std::isnan(error_budget(state, 1e-3, params).total.position_m));
}

}  // namespace
}  // namespace tricoil::error_model
