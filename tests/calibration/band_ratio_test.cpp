// The ratio of two bands, from columns of a moving sensor.
#include "board/host/calibration/band_ratio.hpp"
#include "core/linear/eigen.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tricoil::host {
namespace {

constexpr double kNoise = 1e-3;  // of a low coupling

/// Columns with random couplings of up to 1.
BandRatio measured(const Mat3<double>& truth, int columns, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> coupling(-1, 1);
    std::normal_distribution<double> noise(0, kNoise);
    BandRatio bands(1);
    for (int n = 0; n < columns; ++n) {
        const int j = n % 3;
        const Vec3<double> high(coupling(random), coupling(random), coupling(random));
        const Vec3<double> low = high.cwiseProduct(truth.col(j)) + Vec3<double>(noise(random), noise(random), noise(random));
        bands.add(j, high, low, Vec3<double>::Zero());
    }
    return bands;
}

TEST(BandRatio, IsFoundWithItsStandardDeviation) {
    Mat3<double> truth;
    truth << 1.002, 0.999, 1, 0.997, 1.001, 1.003, 1, 1, 0.998;
    constexpr int kRuns = 200;
    constexpr int kColumns = 900;
    const double expected = kNoise / std::sqrt(kColumns / 9.0);  // a third of them per coil; the mean square of a coupling is 1/3
    Mat3<double> squares = Mat3<double>::Zero();
    for (int run = 0; run < kRuns; ++run) {
        const BandRatio bands = measured(truth, kColumns, static_cast<std::uint64_t>(run));
        EXPECT_EQ(bands.columns(), kColumns);
        EXPECT_LT((eigen(bands.sigma()).array() / expected - 1).abs().maxCoeff(), 0.25);
        squares += (bands.ratio() - truth).cwiseAbs2() / kRuns;
    }
    EXPECT_LT((eigen(squares.cwiseSqrt()).array() / expected - 1).abs().maxCoeff(), 0.25) << eigen(squares.cwiseSqrt());
}

/// Hum whose sign changes from column to column, and a gap within one mean.
TEST(BandRatio, MeansRemoveHum) {
    BandRatio bands(4);
    const Vec3<double> high(0.5, -0.4, 0.3);
    const Vec3<double> hum(0.1, 0.1, 0.1);
    for (int n = 0; n < 120; ++n) {
        bands.add(0, high, 1.01 * high + (n % 2 == 0 ? hum : Vec3<double>(-hum)), Vec3<double>::Zero());
    }
    bands.add(0, high, high + hum, hum);
    bands.restart(0);
    EXPECT_LT((eigen(bands.ratio().col(0)).array() - 1.01).abs().maxCoeff(), 1e-12);
    EXPECT_LT(bands.sigma().col(0).maxCoeff(), 1e-6);
}

/// A phase turns a part of the coupling into quadrature; the ratio is that of the amplitudes. Motion causes another quadrature.
TEST(BandRatio, PhasesComeFromRests) {
    constexpr double kPhase_rad = 0.03;
    constexpr double kRatio = 1.02;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> coupling(-1, 1);
    BandRatio bands(2);
    EXPECT_FALSE(bands.knows_phases());
    for (int n = 0; n < 300; ++n) {
        const Vec3<double> high(coupling(random), coupling(random), coupling(random));
        const bool rests = n < 150;
        for (const double change : {0.0, rests ? 1e-4 : 0.1}) {
            const Vec3<double> now = (1 + change) * high;
            const Vec3<double> quadrature = kRatio * std::sin(kPhase_rad) * now;
            bands.add(n % 3, now, kRatio * std::cos(kPhase_rad) * now, rests ? quadrature : Vec3<double>(Vec3<double>::Ones()));
        }
    }
    EXPECT_TRUE(bands.knows_phases());
    EXPECT_LT((eigen(bands.ratio()).array() - kRatio).abs().maxCoeff(), 1e-12);
    EXPECT_LT((eigen(bands.phase_rad()).array() - kPhase_rad).abs().maxCoeff(), 1e-12);
    EXPECT_LT(bands.phase_sigma_rad().maxCoeff(), 1e-6);
}

TEST(BandRatio, IsUnknownWithoutColumns) {
    EXPECT_FALSE(BandRatio(1).ratio().allFinite());
    EXPECT_FALSE(BandRatio(1).sigma().maxCoeff() <= 1);
}

}  // namespace
}  // namespace tricoil::host
