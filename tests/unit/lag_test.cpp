#include <gtest/gtest.h>

#include <random>

#include "core/tracking/judge/misfit.hpp"
#include "core/tracking/scaat/adaptation.hpp"

namespace tricoil {
namespace {

constexpr double kBefore_m2 = 3e-8, kAfter_m2 = 2.7e-8;  // a column corrects a tenth

TEST(Lag, IsPartOfTheCovarianceWithItsSquare) {
    tracking::scaat::Lag<double> lag;
    const Vec3<double> lag_m{3e-3, 0, -1e-3};
    for (int column = 0; column < 200; ++column) {
        lag.add(0.1 * lag_m, kBefore_m2, kAfter_m2);
    }
    Mat3<double> covariance = Mat3<double>::Zero();
    lag.cover(covariance);
    EXPECT_NEAR(covariance(0, 0), 9e-6, 0.1 * 9e-6);
    EXPECT_NEAR(covariance(0, 2), -3e-6, 0.1 * 3e-6);
    EXPECT_EQ(covariance(1, 1), 0);
}

TEST(Lag, CorrectionsWithoutOneSeldomCount) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal(0, std::sqrt((kBefore_m2 - kAfter_m2) / 3));
    tracking::scaat::Lag<double> lag;
    int counted = 0;
    constexpr int kColumns = 20'000;
    for (int column = 0; column < kColumns; ++column) {
        lag.add({normal(random), normal(random), normal(random)}, kBefore_m2, kAfter_m2);
        Mat3<double> covariance = Mat3<double>::Zero();
        lag.cover(covariance);
        counted += covariance.trace() > 0 ? 1 : 0;
    }
    EXPECT_LT(counted, kColumns / 60);
    EXPECT_GT(counted, 0);
}

TEST(Misfit, OfOneMatrixCountsWithItsShareAndTwoInARowWhole) {
    tracking::Misfit<double> whole, part;
    for (int matrix = 1; matrix <= 2; ++matrix) {
        whole.add(300, 1, 1, 16, DeviceTime(Microseconds{4167 * matrix}));
        part.add(300, 1, 1, 16, DeviceTime(Microseconds{4167 * matrix}), 0.04);
        EXPECT_NEAR(part.variance(), (matrix == 1 ? 0.04 : 1) * whole.variance(), 1e-9);
    }
}

}  // namespace
}  // namespace tricoil
