// Quadrature by motion, from frames of a moving sensor.
#include "board/host/calibration/band_ratio.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tricoil::host {
namespace {

constexpr double kFrame_s = 1.0 / 240;
constexpr double kColumnNoise = 5e-7;  // of a coupling, in phase and in quadrature

/// Couplings that oscillate, each at its own rate.
Mat3<double> couplings(double time_s) {
    Mat3<double> x;
    for (int n = 0; n < 9; ++n) {
        x(n) = 0.01 * std::sin((3 + n) * time_s + n);
    }
    return x;
}

Mat3<double> rates(double time_s) {
    constexpr double kStep_s = 1e-4;
    return (couplings(time_s + kStep_s) - couplings(time_s - kStep_s)) / (2 * kStep_s);
}

Mat3<double> true_lag_s() {
    Mat3<double> lag_s;
    lag_s << -3e-5, 9e-5, 2e-5, -8e-5, -2.4e-5, 7e-5, -3e-5, -6e-5, -1.8e-5;
    return lag_s;
}

/// speed: 0 for a resting sensor.
void add_frames(MotionLag& lag, int frames, double speed, double noise, std::uint64_t seed = 1) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, noise);
    for (int n = 0; n < frames; ++n) {
        const double time_s = speed * n * kFrame_s;
        const auto added = [&]() -> Mat3<double> { return Mat3<double>::NullaryExpr([&] { return normal(random); }); };
        lag.add(couplings(time_s) + added(), speed * rates(time_s) * true_lag_s() + added(), noise * noise, kFrame_s);
    }
}

TEST(MotionLag, IsFoundWithItsStandardDeviation) {
    constexpr int kRuns = 100;
    double squares = 0;
    for (int run = 0; run < kRuns; ++run) {
        MotionLag lag;
        add_frames(lag, 720, 1, kColumnNoise, static_cast<std::uint64_t>(run));
        ASSERT_TRUE(lag.is_known());
        squares += (lag.lag_s() - true_lag_s()).cwiseQuotient(lag.sigma_s()).cwiseAbs2().mean() / kRuns;
    }
    EXPECT_NEAR(squares, 1, 0.25);
}

TEST(MotionLag, NeedsMotionAndQuadrature) {
    MotionLag resting;
    add_frames(resting, 720, 0, kColumnNoise);
    EXPECT_FALSE(resting.is_known());
    MotionLag few;
    add_frames(few, 80, 1, kColumnNoise);
    EXPECT_FALSE(few.is_known());
    MotionLag noisy;
    add_frames(noisy, 720, 1, 1e3 * kColumnNoise);
    EXPECT_FALSE(noisy.is_known());
    MotionLag without;  // a device that sends no quadrature
    for (int n = 0; n < 720; ++n) {
        without.add(couplings(n * kFrame_s), Mat3<double>::Zero(), 0, kFrame_s);
    }
    EXPECT_FALSE(without.is_known());
}

TEST(MotionLag, AGapIsNoMotion) {
    MotionLag lag;
    add_frames(lag, 720, 1, 0);
    lag.restart();
    lag.add(1e3 * couplings(9), Mat3<double>::Zero(), 0, kFrame_s);
    lag.add(-1e3 * couplings(9), Mat3<double>::Zero(), 0, kFrame_s);
    lag.restart();
    EXPECT_LT((lag.lag_s() - true_lag_s()).norm(), 1e-2 * true_lag_s().norm());
}

}  // namespace
}  // namespace tricoil::host
