// Small metal in the mean quadrature of the high band: found in noise and in motion, not found without metal.
#include "core/tracking/metal/mean_quadrature.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tricoil::tracking {
namespace {

constexpr double kNoise = 1e-6;
constexpr double kVariance = kNoise * kNoise;
constexpr DualBandParams kBands;

/// motion_lag_s: zero: unknown.
MeanQuadrature make_mean(const Mat3<double>& motion_lag_s = Mat3<double>::Zero()) { return {kBands, 1e-4, motion_lag_s}; }

class MeanQuadratureTest : public ::testing::Test {
protected:
    /// rate: of every coupling, 1/s. metal: quadrature of every coupling.
    void add_frames(MeanQuadrature& mean, int frames, double rate, double metal) {
        for (int n = 0; n < frames; ++n) {
            time_s_ += kBands.frame_s;
            const Mat3<double> x = Mat3<double>::Constant(0.01 + rate * time_s_);
            const Mat3<double> noise = Mat3<double>::NullaryExpr([this] { return noise_(random_); });
            mean.add(x, Mat3<double>::Constant(rate) * true_lag_s_ + Mat3<double>::Constant(metal) + noise, kVariance);
        }
    }

    Mat3<double> true_lag_s_ = (Mat3<double>() << -3e-5, 9e-5, 2e-5, -8e-5, -2.4e-5, 7e-5, -3e-5, -6e-5, -1.8e-5).finished();
    double time_s_ = 0;
    std::mt19937_64 random_{7};
    std::normal_distribution<double> noise_{0, kNoise};
};

TEST_F(MeanQuadratureTest, NoiseAloneHardlyWidensTheCovariance) {
    MeanQuadrature mean = make_mean();
    add_frames(mean, 24, 0, 0);
    double sum = 0;
    constexpr int kFrames = 20'000;
    for (int n = 0; n < kFrames; ++n) {
        add_frames(mean, 1, 0, 0);
        sum += mean.effect_variance(0) / kFrames;
    }
    EXPECT_LT(sum, 0.1 * kVariance);
}

/// The quadrature of one frame is within its noise.
TEST_F(MeanQuadratureTest, MetalIsFoundBelowTheNoiseOfAFrame) {
    MeanQuadrature mean = make_mean();
    add_frames(mean, 72, 0, kNoise);
    EXPECT_GT(mean.effect_variance(0), 10 * kVariance);
    EXPECT_EQ(mean.effect_variance(2 * kNoise), 0) << "within the floor of the calibration";
    mean.clear();
    EXPECT_EQ(mean.effect_variance(0), 0);
}

TEST_F(MeanQuadratureTest, KnownMotionIsSubtracted) {
    constexpr double kRate = 0.02;  // causes a quadrature of about 1.5 times the noise
    MeanQuadrature unknown = make_mean();
    add_frames(unknown, 72, kRate, 0);
    EXPECT_EQ(unknown.effect_variance(0), 0) << "may be motion";
    MeanQuadrature known = make_mean(true_lag_s_);
    double clean = 0;
    constexpr int kFrames = 2000;
    for (int n = 0; n < kFrames; ++n) {
        add_frames(known, 1, kRate, 0);
        clean += known.effect_variance(0) / kFrames;
    }
    EXPECT_LT(clean, 0.1 * kVariance);
    add_frames(known, 72, kRate, kNoise);
    EXPECT_GT(known.effect_variance(0), 10 * kVariance);
    MeanQuadrature wrong = make_mean(-true_lag_s_);
    add_frames(wrong, 72, kRate, 0);
    EXPECT_GT(wrong.effect_variance(0), 10 * kVariance);
}

}  // namespace
}  // namespace tricoil::tracking
