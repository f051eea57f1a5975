// Tracker for two bands: columns in, poses out, with gaps, faults and a calibration.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/tracking/metal/dual_band_tracker.hpp"
#include "tests/support/two_bands.hpp"

namespace tricoil::tracking {
namespace {

constexpr std::int64_t kFrame_us = 4167;

/// A resting sensor at 0.5 m beside a sphere.
class DualBandTest : public ::testing::Test {
protected:
    DualBandTest() {
        pose_.position_m = {0.4, 0.2, 0.2};
        pose_.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(Vec3<double>(0.3, -0.5, 0.7));
        params_.method = DualBandParams{};
        params_.common.coupling_constant = test::kDualBandCoupling;
        params_.common.hemisphere = pose_.position_m;
    }

    struct Scene {
        double share = 0.1;
        double effect = 0;      // of the sphere
        double misfit = 0;      // of the coils, relative to k, equal in both bands
        bool low = true;        // the low band's columns come
        double quadrature = 0;  // of the high band's couplings
    };

    /// The last pose.
    PoseEstimate<double> run(DualBandTracker& tracker, int frames, const Scene& scene) {
        PoseEstimate<double> last;
        const auto model = field::GeneralDipole<double>::concentric(test::kDualBandCoupling);
        const Mat3<double> clean =
            field::signal_matrix<double>(model, pose_.position_m, pose_.q_source_sensor.conjugate().toRotationMatrix());
        const double k = field::coupling_strength(test::kDualBandCoupling, pose_.position_m.norm());
        const Mat3<double> coils = clean + scene.misfit * k * pattern_;
        const Mat3<double> metal = scene.effect * test::two_bands_detail::through_sphere(model, pose_, {0.2, -0.1, 0.15});
        for (int n = 0; n < frames; ++n, time_us_ += kFrame_us) {
            if (const auto pose = add(tracker, coils + metal, scene.quadrature, 1e-6, false)) {
                last = *pose;
            }
            if (scene.low) {
                EXPECT_FALSE(add(tracker, coils + scene.share * metal, 0, 1e-5, true));
            }
        }
        return last;
    }

    double error_m(const PoseEstimate<double>& estimate) const { return (estimate.position_m - pose_.position_m).norm(); }

    TrackerParams<double> params_;
    std::int64_t time_us_ = 1'000'000;

private:
    std::optional<PoseEstimate<double>> add(DualBandTracker& tracker, const Mat3<double>& x, double quadrature, double sigma,
                                            bool is_low) {
        std::optional<PoseEstimate<double>> last;
        for (int j = 0; j < kSourceCoils; ++j) {
            Column<double> column;
            column.state = single_coil(j);
            column.midpoint = device_time_us(time_us_);
            column.sigma.setConstant(sigma);
            column.in_phase = x.col(j) + sigma * Vec3<double>::NullaryExpr([this] { return normal_(random_); });
            column.quadrature.setConstant(quadrature);
            column.flags.set_if(is_low, ColumnFlag::low_band);
            const auto pose = tracker.update(column);
            last = pose ? pose : last;
        }
        return last;
    }

    solver::RigidPose<double> pose_;
    const Mat3<double> pattern_ = (Mat3<double>() << 1, -1, 1, 1, 1, -1, -1, 1, 1).finished();
    std::mt19937 random_{11};
    std::normal_distribution<double> normal_;
};

TEST_F(DualBandTest, RemovesMetal) {
    DualBandTracker tracker(params_);
    const auto first = run(tracker, 20, {.effect = -1e-4});
    const auto pose = run(tracker, 60, {.effect = -1e-4});
    EXPECT_GT(error_m(first), 3e-3);
    EXPECT_LT(error_m(pose), error_m(first) / 8);
    EXPECT_LT(error_m(pose), 4 * deviation_m(pose));
    EXPECT_LT(deviation_m(pose), deviation_m(first) / 2);
    EXPECT_TRUE(pose.valid());
    EXPECT_TRUE(pose.flags.has(PoseFlag::distorted));
}

TEST_F(DualBandTest, MetalWithAShareNearOneStaysInTheDeviation) {
    DualBandTracker tracker(params_);
    const auto pose = run(tracker, 80, {.share = 0.97, .effect = -1e-4});
    EXPECT_GT(error_m(pose), 2e-3);
    EXPECT_LT(error_m(pose), 4 * deviation_m(pose));
}

/// Its share differs between the couplings, by more than the misfit shows.
TEST_F(DualBandTest, FerromagneticMetalStaysInTheDeviation) {
    const auto deviation_beside = [&](double share, int frames) {
        DualBandTracker tracker(params_);
        return deviation_m(run(tracker, frames, {.share = share, .effect = -1e-4}));
    };
    const double high_m = deviation_beside(4, 1);
    for (const double share : {-2.0, 4.0}) {
        EXPECT_GT(deviation_beside(share, 80), 0.9 * high_m) << share;
    }
}

/// A misfit of the coils is equal in both bands, so no comparison shows it.
TEST_F(DualBandTest, MisfitOfTheCoilsStaysInTheDeviation) {
    params_.common.misfit_floor = 2e-3;
    DualBandTracker tracker(params_);
    const auto pose = run(tracker, 80, {.misfit = 2e-3});
    EXPECT_GT(error_m(pose), 1e-4);
    EXPECT_LT(error_m(pose), 3 * deviation_m(pose));
}

TEST_F(DualBandTest, LostFramesAndAClockRestartStartANewWindow) {
    DualBandTracker tracker(params_);
    const Scene metal{.effect = -1e-4};
    const double high_m = error_m(run(tracker, 1, metal));
    for (const std::int64_t jump_us : {2 * kFrame_us, std::int64_t{-900'000}}) {
        ASSERT_LT(error_m(run(tracker, 60, metal)), high_m / 8);
        time_us_ += jump_us;
        EXPECT_GT(error_m(run(tracker, 12, metal)), high_m / 2) << jump_us;
    }
    ASSERT_LT(error_m(run(tracker, 60, metal)), high_m / 8);
    run(tracker, 1, {.effect = -1e-4, .low = false});
    EXPECT_GT(error_m(run(tracker, 12, metal)), high_m / 2);
    EXPECT_LT(error_m(run(tracker, 60, metal)), high_m / 8);
}

/// A refused column must not reach the comparison of the bands.
TEST_F(DualBandTest, QuadraturesOfRefusedColumnsAreNotUsed) {
    params_.common.quadrature_floor = 0;
    DualBandTracker tracker(params_);
    const double high_m = error_m(run(tracker, 1, {.effect = -1e-4}));
    Column<double> broken;
    broken.state = Excitation::s2;
    broken.midpoint = device_time_us(time_us_ - kFrame_us);
    broken.sigma.setConstant(1e-6);
    broken.quadrature.setConstant(std::nan(""));
    for (int n = 0; n < 60; ++n) {
        broken.midpoint = device_time_us(time_us_ - kFrame_us);
        EXPECT_FALSE(tracker.update(broken));
        run(tracker, 1, {.effect = -1e-4});
    }
    const auto pose = run(tracker, 1, {.effect = -1e-4});
    EXPECT_LT(error_m(pose), high_m / 8);
    EXPECT_LT(error_m(pose), 5 * deviation_m(pose));
}

/// Neither the misfit nor the low band shows this metal.
TEST_F(DualBandTest, AQuadratureBelowTheNoiseWidensTheDeviation) {
    const auto deviation_after = [&](double quadrature_floor, int frames, double quadrature) {
        params_.common.quadrature_floor = quadrature_floor;
        DualBandTracker tracker(params_);
        return deviation_m(run(tracker, frames, {.quadrature = quadrature}));
    };
    const double clean_m = deviation_after(0, 20, 0);
    EXPECT_GT(deviation_after(0, 20, 1e-6), 3 * clean_m);
    EXPECT_GT(deviation_after(0, 60, 1e-6), 3 * clean_m);
    EXPECT_LT(deviation_after(1, 60, 1e-6), 1.1 * clean_m) << "phases unknown";
    EXPECT_LT(deviation_after(0, 60, 2e-5), deviation_after(0, 20, 2e-5) / 2) << "the low band would show more";
}

TEST_F(DualBandTest, TheLastPoseBecomesStale) {
    DualBandTracker tracker(params_);
    EXPECT_FALSE(tracker.tick(device_time_us(time_us_)));
    const auto last = run(tracker, 40, {});
    EXPECT_FALSE(tracker.tick(device_time_us(time_us_ + 50'000)));
    const auto stale = tracker.tick(device_time_us(time_us_ + 200'000));
    ASSERT_TRUE(stale);
    EXPECT_TRUE(stale->flags.has(PoseFlag::stale));
    EXPECT_EQ(stale->position_m, last.position_m);
    EXPECT_EQ(tracker.state(), TrackerState::lost);
}

TEST_F(DualBandTest, SurroundingsAreRefused) {
    calibration::Calibration<double> calibration;
    calibration.model.source_moment *= test::kDualBandCoupling;
    (void)calibration.model.surroundings.push_back({{0.5, 0, -0.5}, 1e-5 * Mat3<double>::Identity()});
    const auto correction = calibration::CoilCorrection<double>::ideal_triads(calibration);
    ASSERT_TRUE(correction.ok());
    EXPECT_EQ(DualBandTracker::check(*correction).code(), StatusCode::invalid_argument);
    EXPECT_TRUE(DualBandTracker::check(std::nullopt).ok());
}

}  // namespace
}  // namespace tricoil::tracking
