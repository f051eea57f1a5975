#include "core/fixed/previous_measurement.hpp"

#include <gtest/gtest.h>

#include "core/geometry/rotations.hpp"
#include "core/solver/previous_measurement.hpp"
#include "tests/fixed/converter.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::fixed {
namespace {

template <typename Derived>
auto units(const Dense<Derived>& m) {
    return m.unaryExpr([](double entry) { return Unit::from(entry); });
}

VectorPose as_fixed(const solver::VectorPose<double>& pose) {
    return {Metres::from(pose.range_m), units(pose.direction), units(pose.attitude)};
}

double distance_m(const VectorPose& a, const solver::VectorPose<double>& b) {
    return (a.range_m.to_double() * to_double(a.direction) - b.range_m * b.direction).norm();
}

TEST(FixedPreviousMeasurement, OneStepAgreesWithDouble) {
    test::RandomPoses random(31);
    for (int n = 0; n < 5000; ++n) {
        const double range = random.uniform(0.15, 1.2);
        const Vec3<double> u = random.direction();
        const Quat<double> q = random.attitude();
        const auto codes = as_codes(test::unit_signal(range * u, q));
        const auto nudge = geometry::rotation_vector_to_quaternion<double>(0.1 * random.direction());
        const solver::VectorPose<double> before{range, nudge * u, geometry::attitude_matrix(nudge * q)};
        const auto exact = solver::step_vectors<double>(as_double(codes), 1, before);
        const auto ours = step_vectors(codes, scaled_from(1), as_fixed(before));
        ASSERT_TRUE(exact.ok() && ours.ok());
        ASSERT_LT(distance_m(*ours, *exact), 1e-6);
        ASSERT_LT((to_double(ours->attitude) - exact->attitude).norm(), 1e-6);
    }
}

/// Motion like that of a hand: sums of sines that do not repeat, up to about 1 m/s and 3 rad/s.
solver::VectorPose<double> hand_at(double t) {
    const auto wave = [t](double a, double b, double c) {
        return a * std::sin(b * t + c) + 0.3 * a * std::sin(3.7 * b * t + 2 * c);
    };
    const Vec3<double> p(0.55 + wave(0.15, 1.3, 0.1), wave(0.3, 1.1, 1.0), wave(0.25, 0.9, 2.0));
    const geometry::Euler<double> e{wave(1.2, 0.7, 0.5), wave(1.0, 0.8, 1.5), wave(1.5, 0.6, 2.5)};
    return {p.norm(), p.normalized(), geometry::attitude_matrix(e)};
}

TEST(FixedPreviousMeasurement, ClosedLoopStaysWithDoubleForTenMinutes) {
    constexpr double kRate_hz = 240;
    auto exact = hand_at(0);
    auto ours = as_fixed(exact);
    double worst_m = 0;
    double worst_rotation = 0;
    for (int n = 1; n <= 600 * kRate_hz; ++n) {
        const auto truth = hand_at(n / kRate_hz);
        const auto codes = as_codes(field::signal_matrix<double>(1, truth.range_m * truth.direction, truth.attitude));
        exact = *solver::step_vectors<double>(as_double(codes), 1, exact);
        const auto next = step_vectors(codes, scaled_from(1), ours);
        ASSERT_TRUE(next.ok());
        ours = *next;
        worst_m = std::max(worst_m, distance_m(ours, exact));
        worst_rotation = std::max(
            worst_rotation, (to_double(ours.attitude).transpose() * to_double(ours.attitude) - Mat3<double>::Identity()).norm());
    }
    std::printf("ten minutes closed loop: %.3g mm from double, attitude off a rotation by %.3g\n", worst_m * 1e3, worst_rotation);
    EXPECT_LT(worst_m, 1e-7);  // required: 1e-4 m
    EXPECT_LT(worst_rotation, 1e-7);
}

TEST(FixedPreviousMeasurement, ReportsAPreviousPoseTooFarAway) {
    const auto codes = as_codes(test::unit_signal({0.5, 0, 0}, Quat<double>::Identity()));
    VectorPose sideways;
    sideways.direction = Vec3<Unit>(0, 1, 0);
    EXPECT_EQ(step_vectors(codes, scaled_from(1), sideways).status().code(), StatusCode::not_converged);
    EXPECT_EQ(step_vectors({}, scaled_from(1), {}).status().code(), StatusCode::degenerate);
    EXPECT_EQ(step_vectors(codes, Scaled{}, {}).status().code(), StatusCode::invalid_argument);
}

TEST(FixedPreviousMeasurement, RefusesAnInvalidPose) {
    const auto codes = as_codes(test::unit_signal({0.5, 0, 0}, Quat<double>::Identity()));
    const auto refused = [&codes](auto&& change) {
        VectorPose pose;
        change(pose);
        return step_vectors(codes, scaled_from(1), pose).status().code() == StatusCode::invalid_argument;
    };
    EXPECT_FALSE(refused([](VectorPose&) {}));
    EXPECT_TRUE(refused([](VectorPose& p) { p.direction = Vec3<Unit>(1, 1, 0); }));
    EXPECT_TRUE(refused([](VectorPose& p) { p.attitude.rowwise() = Matrix<Unit, 1, 3>(1, 0, 0); }));  // equal rows
    EXPECT_TRUE(refused([](VectorPose& p) { p.attitude(2, 2) = Unit(-1); }));                         // a reflection
    EXPECT_TRUE(refused([](VectorPose& p) { p.attitude.col(0) = p.attitude.col(1); }));
    EXPECT_TRUE(refused([](VectorPose& p) { p.attitude.row(1) << Unit::from(0.1), Unit::from(0.995), Unit(0); }));  // sheared
}

TEST(FixedPreviousMeasurement, SurvivesArbitraryInput) {
    std::mt19937_64 random(32);
    const auto any = [&random] { return static_cast<std::int32_t>(static_cast<std::uint32_t>(random())); };
    test::RandomPoses poses(33);
    int stepped = 0;
    for (int n = 0; n < 50'000; ++n) {
        BlockMatrix x;
        VectorPose pose = as_fixed({1, poses.direction(), geometry::attitude_matrix(poses.attitude())});
        for (Index i = 0; i < 9; ++i) {
            x.mantissa(i) = any();
        }
        if (n % 2 == 0) {
            pose.attitude(n % 9) = Unit::from_raw(any());
            pose.direction(n % 3) = Unit::from_raw(any());
        }
        const auto next = step_vectors(x, scaled_from(1), pose, 2);
        if (next.ok()) {
            ++stepped;
            ASSERT_GE(next->range_m.raw(), 0);
        }
    }
    EXPECT_GT(stepped, 200);
}

}  // namespace
}  // namespace tricoil::fixed
