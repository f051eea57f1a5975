#include "core/fixed/demodulator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/signal/lock_in.hpp"

namespace tricoil::fixed {
namespace {

std::vector<Sample> tones(int cycles, int window, const std::array<double, kChannels>& amplitudes, std::mt19937_64& random) {
    std::uniform_real_distribution<double> phase(-3, 3);
    std::normal_distribution<double> noise(0, 20);
    std::array<double, kChannels> phases{};
    for (double& p : phases) {
        p = phase(random);
    }
    std::vector<Sample> samples(static_cast<std::size_t>(window));
    for (std::size_t n = 0; n < samples.size(); ++n) {
        for (std::size_t c = 0; c < kChannels; ++c) {
            const double angle = 2 * std::numbers::pi * cycles * static_cast<double>(n) / window + phases[c];
            samples[n][c] = static_cast<std::int32_t>(std::lround(amplitudes[c] * std::cos(angle) + noise(random)));
        }
    }
    return samples;
}

TEST(FixedDemodulator, AgreesWithDoubleOverTheConvertersRange) {
    std::mt19937_64 random(41);
    double worst_codes = 0;
    double worst_share = 0;
    for (int n = 0; n < 300; ++n) {
        const int window = 50 + static_cast<int>(random() % 975);
        const int cycles = 4 + static_cast<int>(random() % static_cast<unsigned>(window / 3));
        const double size = std::exp2(-static_cast<double>(random() % 14));
        const auto samples = tones(cycles, window, {8e6 * size, 3e6 * size, 1e6 * size, 5e6}, random);
        const std::span<const Sample> span(samples);
        const auto exact = signal::lock_in(signal::Oscillator<double>(cycles, window), span);
        const auto sums = lock_in(Oscillator(cycles, window), span);
        for (std::size_t c = 0; c < kChannels; ++c) {
            const double scale = std::ldexp(2.0 / window, -30);
            worst_codes = std::max({worst_codes, std::abs(static_cast<double>(sums[c].re) * scale - exact[c].real()),
                                    std::abs(static_cast<double>(sums[c].im) * scale - exact[c].imag())});
        }
        const auto column = couplings(sums, samples.size(), 1000);
        ASSERT_TRUE(column.ok());
        double largest = 0;
        double worst = 0;
        for (Eigen::Index i = 0; i < 3; ++i) {
            const auto ratio = exact[static_cast<std::size_t>(i)] / exact[kReferenceChannel];
            largest = std::max({largest, std::abs(ratio)});
            worst = std::max({worst, std::abs(std::ldexp(column->in_phase(i), column->exponent) - ratio.real()),
                              std::abs(std::ldexp(column->quadrature(i), column->exponent) - ratio.imag())});
        }
        worst_share = std::max(worst_share, worst / largest);
    }
    std::printf("lock-in: %.2g codes from double; couplings: %.2g of the largest\n", worst_codes, worst_share);
    EXPECT_LT(worst_codes, 0.2);  // a converter's own noise is some tens
    EXPECT_LT(worst_share, 1e-7);
}

TEST(FixedDemodulator, LargestCodesDoNotOverflow) {
    std::vector<Sample> samples(kMaxBlockSamples);
    constexpr int kCycles = 64;
    for (std::size_t n = 0; n < samples.size(); ++n) {
        const bool up = std::cos(2 * std::numbers::pi * kCycles * static_cast<double>(n) / kMaxBlockSamples) > 0;
        samples[n].fill(up ? std::numeric_limits<std::int32_t>::max() : std::numeric_limits<std::int32_t>::min());
    }
    const auto sums = lock_in(Oscillator(kCycles, kMaxBlockSamples), samples);
    const auto column = couplings(sums, samples.size(), 1000);
    ASSERT_TRUE(column.ok());
    for (Eigen::Index i = 0; i < 3; ++i) {
        EXPECT_NEAR(std::ldexp(column->in_phase(i), column->exponent), 1, 1e-8);
    }
}

TEST(FixedDemodulator, SaysWhenThereIsNoReference) {
    std::mt19937_64 random(42);
    const auto samples = tones(10, 200, {1e6, 1e6, 1e6, 100}, random);
    const auto sums = lock_in(Oscillator(10, 200), samples);
    EXPECT_EQ(couplings(sums, 200, 1000).status().code(), StatusCode::degenerate);
    EXPECT_EQ(couplings({}, 200, 0).status().code(), StatusCode::degenerate);
}

TEST(FixedDemodulator, ColumnsOfDifferentSizesMakeOneMatrix) {
    BlockColumn large;
    large.in_phase << (1 << 29), 1000, -1000;
    large.exponent = -20;
    BlockColumn small = large;
    small.exponent = -30;
    BlockColumn tiny = large;
    tiny.exponent = -120;
    const BlockMatrix x = assemble({small, large, tiny});
    EXPECT_EQ(x.exponent, -20);
    EXPECT_EQ(x.mantissa(0, 0), 1 << 19);
    EXPECT_EQ(x.mantissa(1, 0), 1);
    EXPECT_EQ(x.mantissa(0, 1), 1 << 29);
    EXPECT_EQ(x.mantissa(0, 2), 0);
}

}  // namespace
}  // namespace tricoil::fixed
