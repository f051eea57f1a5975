// The exact one-step expressions against forward model and solver.
#include "core/error_model/exact_step.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/error_model/accumulated_error.hpp"
#include "core/field/concentric_dipole.hpp"
#include "tests/error_model/azimuth_increment_error.hpp"

namespace tricoil::error_model {
namespace {

using AnglePose = solver::AnglePose<double>;

constexpr std::uint64_t kPosesSeed = 20240611;
constexpr double kStrength = 0.8;

class Sweep {
public:
    AnglePose pose() { return {{0.1 + 2 * share(), angle(3.1), angle(1.45)}, {angle(3.1), angle(1.45), angle(3.1)}}; }

    AnglePose near(const AnglePose& pose, double size) {
        const auto& [p, a] = pose;
        return {{p.range_m * (1 + angle(0.1)), p.azimuth_rad + angle(size), p.elevation_rad + angle(size)},
                {a.azimuth_rad + angle(size), a.elevation_rad + angle(size), a.roll_rad + angle(size)}};
    }

private:
    double share() { return unit_(random_); }
    double angle(double size) { return size * (2 * unit_(random_) - 1); }
    std::mt19937_64 random_{kPosesSeed};
    std::uniform_real_distribution<double> unit_{0, 1};
};

Mat3<double> signal_matrix(const AnglePose& pose) {
    return field::signal_matrix<double>(kStrength, geometry::to_cartesian(pose.position),
                                        geometry::attitude_matrix(pose.attitude));
}

double worst(const PoseAngleError<double>& error, const AnglePose& real, const AnglePose& measured) {
    const auto& [rp, ra] = real;
    const auto& [mp, ma] = measured;
    Vec6<double> difference;
    difference << error.position.range_m - (rp.range_m - mp.range_m),
        error.position.azimuth_rad - (rp.azimuth_rad - mp.azimuth_rad),
        error.position.elevation_rad - (rp.elevation_rad - mp.elevation_rad),
        error.attitude.azimuth_rad - (ra.azimuth_rad - ma.azimuth_rad),
        error.attitude.elevation_rad - (ra.elevation_rad - ma.elevation_rad),
        error.attitude.roll_rad - (ra.roll_rad - ma.roll_rad);
    return difference.cwiseAbs().maxCoeff();
}

TEST(ExactStep, EqualsTheSolverInClosedLoop) {
    Sweep sweep;
    int steps = 0;
    for (int n = 0; n < 20'000; ++n) {
        const AnglePose real = sweep.pose();
        const AnglePose estimate = sweep.near(real, 0.25);
        const auto measured = solver::step_angles(signal_matrix(real), kStrength, estimate);
        const auto predicted = exact_step_error(real, estimate, estimate);
        ASSERT_EQ(measured.ok(), predicted.ok()) << "seed " << kPosesSeed << ", pose " << n;
        if (measured.ok()) {
            ASSERT_LT(worst(*predicted, real, *measured), 1e-10) << "seed " << kPosesSeed << ", pose " << n;
            ++steps;
        }
    }
    EXPECT_GT(steps, 19'000);
}

TEST(ExactStep, EqualsTheSolverInOpenLoop) {
    Sweep sweep;
    for (int n = 0; n < 20'000; ++n) {
        const AnglePose real = sweep.pose();
        const AnglePose before = sweep.near(real, 0.2);
        const AnglePose estimate = sweep.near(real, 0.4);  // an accumulated error of its own
        const auto p = geometry::line_of_sight_rotation(before.position.azimuth_rad, before.position.elevation_rad);
        const Mat3<double> w = p * geometry::attitude_matrix(before.attitude).transpose() * signal_matrix(real) * p.transpose();
        const auto step = solver::tracking_increments(w, kStrength);
        const auto predicted = exact_step_error(real, before, estimate);
        ASSERT_EQ(step.ok(), predicted.ok()) << "seed " << kPosesSeed << ", pose " << n;
        if (!step.ok()) {
            continue;
        }
        const auto measured = solver::add_increments(estimate, *step);
        ASSERT_TRUE(measured.ok());
        ASSERT_LT(worst(*predicted, real, *measured), 1e-10) << "seed " << kPosesSeed << ", pose " << n;
    }
}

/// At fixed, known orientation the closed forms (28), (33) give the same result.
TEST(ExactStep, ReducesToThePositionFormulasAtFixedOrientation) {
    Sweep sweep;
    for (int n = 0; n < 5'000; ++n) {
        AnglePose real = sweep.pose();
        AnglePose before = sweep.near(real, 0.2);
        before.attitude = real.attitude;
        const auto error = exact_step_error(real, before, before);
        ASSERT_TRUE(error.ok());
        const double b = before.position.elevation_rad;
        const LineOfSightStep<double> step{b, real.position.azimuth_rad - before.position.azimuth_rad,
                                           real.position.elevation_rad - b};
        EXPECT_NEAR(error->position.azimuth_rad, azimuth_increment_error(KappaForm::exact, step, 0.0), 1e-12);
        EXPECT_NEAR(error->position.elevation_rad, elevation_increment_error(KappaForm::exact, step), 1e-12);
        EXPECT_NEAR(error->position.range_m, range_error(real.position.range_m, kappa_exact(step)), 1e-12);
    }
}

TEST(ExactStep, RefusesTheSameStepsAsTheSolver) {
    AnglePose real;
    real.position = {1, 0, 0};
    AnglePose before = real;
    before.position.azimuth_rad = 1.0;  // beyond 54.7 degrees
    EXPECT_EQ(exact_step_error(real, before, before).status().code(), StatusCode::not_converged);
}

TEST(ExactStep, FloatFollowsDouble) {
    Sweep sweep;
    for (int n = 0; n < 1'000; ++n) {
        const AnglePose real = sweep.pose();
        const AnglePose estimate = sweep.near(real, 0.1);
        const auto cast = [](const AnglePose& pose) {
            const auto& [p, a] = pose;
            const auto f = [](double v) { return static_cast<float>(v); };
            return solver::AnglePose<float>{{f(p.range_m), f(p.azimuth_rad), f(p.elevation_rad)},
                                            {f(a.azimuth_rad), f(a.elevation_rad), f(a.roll_rad)}};
        };
        const auto single = exact_step_error(cast(real), cast(estimate), cast(estimate));
        const auto twofold = exact_step_error(real, estimate, estimate);
        ASSERT_TRUE(single.ok() && twofold.ok());
        EXPECT_NEAR(single->position.elevation_rad, twofold->position.elevation_rad, 2e-6);
        EXPECT_NEAR(single->position.range_m, twofold->position.range_m, 2e-6);
    }
}

}  // namespace
}  // namespace tricoil::error_model
