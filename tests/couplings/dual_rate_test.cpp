// Dual-rate estimator on simulated couplings in two bands near moving metal.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "board/host/couplings/dual_rate.hpp"
#include "core/geometry/rotations.hpp"
#include "tests/support/two_bands.hpp"

namespace tricoil::host {
namespace {

using test::TwoBandData;
using test::TwoBandScene;

struct Score {
    double high_rms_m = 0;  // error of the high band alone
    double rms_m = 0;
    double max_m = 0;
    double rotation_rms_rad = 0;
    double within_5_sigma = 0;  // share of rows with all three errors within 5 sigma
    double valid = 0;           // share of rows
    double sigma_median_m = 0;
    double roc_area = 0;  // of the distortion figure, for errors of the high band above 1 mm
    double scalar = 0;
    std::vector<Vec3<double>> positions;
};

/// Share of pairs (true, false) in which the true one has the higher value.
double roc_area(const std::vector<double>& value, const std::vector<bool>& is_true) {
    std::vector<std::size_t> order(value.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        order[i] = i;
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value[a] < value[b]; });
    double below = 0;
    double pairs = 0;
    double trues = 0;
    for (const std::size_t i : order) {
        if (is_true[i]) {
            pairs += below;
            ++trues;
        } else {
            ++below;
        }
    }
    return trues > 0 && below > 0 ? pairs / (trues * below) : 0;
}

/// Scored from half a second before the metal comes.
Score track(const TwoBandScene& scene, const TwoBandData& data, std::optional<double> scalar = std::nullopt, bool filter = true) {
    DualRateParams params;
    params.row_period_s = 1 / scene.rate_hz;
    params.rows_per_line = static_cast<int>(scene.ratio);
    params.scalar = scalar;
    params.filter = filter;
    DualRateEstimator estimator(data.high_model, data.low_model, params);
    Score score;
    std::vector<double> distortion;
    std::vector<double> sigma;
    std::vector<bool> wrong;
    solver::RigidPose<double> high = data.truth.front();
    const std::size_t from = data.first_metal_row - static_cast<std::size_t>(scene.rate_hz / 2);
    for (std::size_t n = 0; n < data.high.size(); ++n) {
        if (n % scene.ratio == 0) {
            EXPECT_TRUE(estimator.add_low(data.low[n / scene.ratio]).ok());
        }
        const auto row = estimator.add_high(data.high[n]);
        if (!row.ok()) {
            ADD_FAILURE() << row.status().message();
            break;
        }
        score.positions.push_back(row->pose.position_m);
        if (n < from) {
            continue;
        }
        high = solver::minimise<double>(data.high_model, data.high[n], Mat3<double>(Mat3<double>::Ones()), high)->pose;
        const Vec3<double> error = score.positions.back() - data.truth[n].position_m;
        const double high_error = (high.position_m - data.truth[n].position_m).norm();
        score.high_rms_m += high_error * high_error;
        score.rms_m += error.squaredNorm();
        score.max_m = std::max(score.max_m, error.norm());
        const double turned = geometry::angle_between(row->pose.q_source_sensor, data.truth[n].q_source_sensor);
        score.rotation_rms_rad += turned * turned;
        score.within_5_sigma += error.cwiseAbs().maxCoeff() < 5 * row->position_sigma_m;
        score.valid += row->valid;
        distortion.push_back(row->distortion_m);
        sigma.push_back(row->position_sigma_m);
        wrong.push_back(high_error > 1e-3);
    }
    const auto rows = static_cast<double>(distortion.size());
    score.roc_area = roc_area(distortion, wrong);
    score.high_rms_m = std::sqrt(score.high_rms_m / rows);
    score.rms_m = std::sqrt(score.rms_m / rows);
    score.rotation_rms_rad = std::sqrt(score.rotation_rms_rad / rows);
    score.within_5_sigma /= rows;
    score.valid /= rows;
    std::nth_element(sigma.begin(), sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2), sigma.end());
    score.sigma_median_m = sigma[sigma.size() / 2];
    score.scalar = estimator.scalar().value();
    std::cout << "high band " << 1e3 * score.high_rms_m << " mm RMS; both " << 1e3 * score.rms_m << " mm, max "
              << 1e3 * score.max_m << ", " << 1e3 * score.rotation_rms_rad << " mrad; within 5 sigma " << score.within_5_sigma
              << ", sigma " << 1e3 * score.sigma_median_m << " mm, valid " << score.valid << ", ROC area " << score.roc_area
              << ", scalar " << score.scalar << " (true " << data.share / (1 - data.share) << ")\n";
    return score;
}

Score track(const TwoBandScene& scene) { return track(scene, test::two_bands(scene)); }

TEST(DualRate, RestingSensorBesideMovingMetal) {
    for (const auto& sphere : {test::kSteel304, test::kTitanium}) {
        TwoBandScene scene;
        scene.sphere = sphere;
        scene.sensor_moves = false;
        scene.ratio = 128;
        scene.metal_from_s = 4;
        const Score score = track(scene);
        EXPECT_LT(score.rms_m, score.high_rms_m / 10);
        EXPECT_LT(score.rms_m, 5e-5);
        EXPECT_GE(score.within_5_sigma, 0.99);
        EXPECT_EQ(score.valid, 1);
    }
}

TEST(DualRate, HandAndMetalBothMove) {
    for (const auto& sphere : {test::kSteel304, test::kTitanium}) {
        for (const unsigned seed : {1U, 2U, 3U}) {
            TwoBandScene scene;
            scene.seed = seed;
            scene.sphere = sphere;
            const Score score = track(scene);
            EXPECT_LT(score.rms_m, score.high_rms_m / 3) << "seed " << seed;
            EXPECT_GE(score.within_5_sigma, 0.99) << "seed " << seed;
            EXPECT_GE(score.roc_area, 0.999) << "seed " << seed;
            EXPECT_GT(score.valid, 0.99) << "seed " << seed;
        }
    }
}

TEST(DualRate, ThickAluminiumIsExtrapolatedWithALargeScalar) {
    TwoBandScene scene;
    scene.sphere = test::kAluminium;
    const TwoBandData data = test::two_bands(scene);
    const Score estimated = track(scene, data);
    EXPECT_LT(estimated.rms_m, estimated.high_rms_m / 3);
    EXPECT_GE(estimated.within_5_sigma, 0.99);
    const Score given = track(scene, data, data.share / (1 - data.share));
    EXPECT_LT(given.rms_m, given.high_rms_m / 3);
}

TEST(DualRate, TheFilterIsBetterThanTheHeldBias) {
    const TwoBandScene scene;
    const TwoBandData data = test::two_bands(scene);
    const Score held = track(scene, data, std::nullopt, false);
    const Score filtered = track(scene, data);
    EXPECT_LT(filtered.rms_m, held.rms_m / 2);
    EXPECT_GE(held.within_5_sigma, 0.99);
}

TEST(DualRate, RowsAreCausal) {
    TwoBandScene scene;
    scene.duration_s = 5;
    TwoBandData data = test::two_bands(scene);
    const Score all = track(scene, data);
    data.high.resize(6000);
    data.low.resize(6000 / scene.ratio + 1);
    const Score first = track(scene, data);
    for (std::size_t n = 0; n < first.positions.size(); ++n) {
        ASSERT_EQ(first.positions[n], all.positions[n]) << n;
    }
}

TEST(DualRate, QuaternionIsContinuousOverALoss) {
    const TwoBandData data = test::two_bands({.duration_s = 0.1, .metal_from_s = 0});
    DualRateParams params;
    params.rows_per_line = 1;
    DualRateEstimator estimator(data.high_model, data.low_model, params);
    const Vec3<double> position_m = data.truth.front().position_m;
    const auto turned = [&](double degrees) {
        const Vec3<double> turn = -degrees * 0.0174532925 * Vec3<double>::UnitZ();
        const Mat3<double> o = geometry::rotation_vector_to_quaternion<double>(turn).toRotationMatrix();
        EXPECT_TRUE(estimator.add_low(field::signal_matrix(data.low_model, position_m, o)).ok());
        return estimator.add_high(field::signal_matrix(data.high_model, position_m, o));
    };
    Quat<double> last;
    for (int n = 0; n <= 400; ++n) {
        last = turned(190 + 0.25 * n)->pose.q_source_sensor;
    }
    EXPECT_FALSE(estimator.add_high(Mat3<double>::Ones())->valid);
    const auto after = turned(290);
    ASSERT_TRUE(after->solved);
    EXPECT_GT(after->pose.q_source_sensor.dot(last), 0.99);
}

TEST(DualRate, UnusableCouplingsAreRefused) {
    const TwoBandData data = test::two_bands({.duration_s = 0.1, .metal_from_s = 0});
    DualRateEstimator estimator(data.high_model, data.low_model, {});
    const Mat3<double> bad = Mat3<double>::Constant(std::nan(""));
    EXPECT_EQ(estimator.add_high(bad).status().code(), StatusCode::not_finite);
    EXPECT_EQ(estimator.add_high(Mat3<double>::Zero()).status().code(), StatusCode::degenerate);
    EXPECT_FALSE(estimator.add_high(Mat3<double>::Ones())->valid) << "no dipole";
    EXPECT_TRUE(estimator.add_high(data.high.front())->solved);
}

TEST(BandScalar, NoiseAloneDoesNotMoveIt) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0, 1e-6);
    BandScalar scalar;
    for (int n = 0; n < 1000; ++n) {
        const Vec3<double> noise(normal(random), normal(random), normal(random));
        scalar.add_poses(noise, -noise, 2e-12);
    }
    EXPECT_EQ(scalar.value(), 0);
}

TEST(BandScalar, MovingSensorUsesTheRedundantPart) {
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3<double>(normal(random), normal(random), normal(random)); };
    constexpr double kScalar = 0.25;
    BandScalar scalar;
    for (int n = 0; n < 300; ++n) {
        const Vec3<double> disagreement = 1e-3 * vector();
        scalar.add_poses(20e-3 * vector() + kScalar * disagreement, disagreement, 1e-12);
        const Vec3<double> high = 1e-4 * vector();
        scalar.add_redundant<3>(kScalar / (1 + kScalar) * high + 1e-6 * vector(), high, 1e-12, 0);
    }
    EXPECT_NEAR(scalar.value(), kScalar, 0.01);
    EXPECT_LT(scalar.sigma(), 0.01);
}

}  // namespace
}  // namespace tricoil::host
