// The predicted error of a pose against its real error.
#include <gtest/gtest.h>

#include "core/tracking/matrix/previous_tracker.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kUpdate = 1.0 / 240;

struct Truth {
    Vec3<double> position_m;
    Quat<double> q_source_sensor;
};

/// A steady motion at 1.6 m/s, turning at 3 rad/s.
Truth truth_at(double time_s) {
    const Vec3<double> turn(1.5 * time_s, -2 * time_s, 1.7 * time_s);
    return {{0.4, 0.2 + 1.5 * time_s, -0.1 - 0.6 * time_s}, geometry::rotation_vector_to_quaternion<double>(turn)};
}

TrackerParams<double> params_for(int passes) {
    TrackerParams<double> params;
    params.method = PreviousParams{passes};
    return params;
}

/// Three simultaneous columns without noise.
PoseEstimate<double> feed(Tracker<double>& tracker, const Truth& truth, double time_s) {
    const Mat3<double> x = test::unit_signal(truth.position_m, truth.q_source_sensor);
    std::optional<PoseEstimate<double>> estimate;
    for (int j = 0; j < 3; ++j) {
        Column<double> column;
        column.state = single_coil(j);
        column.midpoint = DeviceTime{microseconds_from_seconds(1 + time_s)};
        column.in_phase = x.col(j);
        column.sigma.setConstant(1e-12);
        estimate = tracker.update(column);
    }
    return *estimate;
}

/// Largest difference between the length of the predicted error and of the real one, mm.
double worst_prediction_mm(int passes) {
    PreviousTracker<double> tracker(params_for(passes));
    double worst = 0;
    for (int n = 0; n < 24; ++n) {
        const Truth truth = truth_at(n * kUpdate);
        const auto estimate = feed(tracker, truth, n * kUpdate);
        if (n > 1) {
            const double real_mm = 1e3 * (estimate.position_m - truth.position_m).norm();
            worst = std::max(worst, std::abs(1e3 * estimate.predicted_error->total.position_m - real_mm));
        }
    }
    return worst;
}

TEST(PredictedError, DependsOnTheNumberOfPasses) {
    EXPECT_LT(worst_prediction_mm(1), 5e-3);
    EXPECT_LT(worst_prediction_mm(2), 1e-5);
    EXPECT_LT(worst_prediction_mm(3), 1e-6);
}

TEST(PredictedError, OfTheFirstPassIsNotZero) {
    PreviousTracker<double> tracker(params_for(1));
    for (int n = 0; n < 3; ++n) {
        feed(tracker, truth_at(n * kUpdate), n * kUpdate);
    }
    EXPECT_GT(feed(tracker, truth_at(3 * kUpdate), 3 * kUpdate).predicted_error->linearization.position_m, 1e-5);
}

/// A rotation beyond the domain of the step: the pose is the direct solution, which has no linearization error.
TEST(PredictedError, OfADirectSolutionHoldsNoLinearization) {
    PreviousTracker<double> tracker(params_for(1));
    feed(tracker, truth_at(0), 0);
    feed(tracker, truth_at(kUpdate), kUpdate);
    Truth turned = truth_at(2 * kUpdate);
    turned.q_source_sensor = turned.q_source_sensor * Quat<double>(0.5, 0.5, 0.5, 0.5);
    const auto estimate = feed(tracker, turned, 2 * kUpdate);
    ASSERT_TRUE(estimate.valid());
    EXPECT_LT((estimate.position_m - turned.position_m).norm(), 1e-9);
    ASSERT_TRUE(estimate.predicted_error);
    EXPECT_EQ(estimate.predicted_error->linearization.position_m, 0);
    EXPECT_LT(estimate.predicted_error->total.position_m, 1e-9);
}

TEST(PredictedError, ANewHemisphereIsNoMotion) {
    PreviousTracker<double> tracker(params_for(1));
    feed(tracker, truth_at(-kUpdate), -kUpdate);  // a first pose is unconfirmed
    feed(tracker, truth_at(0), 0);
    const auto before = feed(tracker, truth_at(kUpdate), kUpdate);
    ASSERT_TRUE(before.predicted_error);
    ASSERT_TRUE(tracker.set_hemisphere(-before.position_m).ok());
    const auto first = feed(tracker, truth_at(2 * kUpdate), 2 * kUpdate);
    EXPECT_LT((first.position_m + truth_at(2 * kUpdate).position_m).norm(), 1e-3);
    EXPECT_FALSE(first.predicted_error) << first.predicted_error->total.position_m << " m";
    const auto second = feed(tracker, truth_at(3 * kUpdate), 3 * kUpdate);
    ASSERT_TRUE(second.predicted_error);
    EXPECT_LT(second.predicted_error->total.position_m, 1e-3);
}

}  // namespace
}  // namespace tricoil::tracking
