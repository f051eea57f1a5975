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
        for (Index i = 0; i < 3; ++i) {
            const auto ratio = exact[static_cast<std::size_t>(i)] / exact[kReferenceChannel];
            largest = std::max({largest, std::abs(ratio)});
            worst = std::max({worst, std::abs(std::ldexp(column->in_phase(i), column->exponent) - ratio.real()),
                              std::abs(std::ldexp(column->quadrature(i), column->exponent) - ratio.imag())});
        }
        worst_share = std::max(worst_share, worst / largest);
    }
    std::printf("lock-in: %.2g codes from double; couplings: %.2g of the largest\n", worst_codes, worst_share);
    EXPECT_LT(worst_codes, 0.2);  // the noise of a converter is some tens of codes
    EXPECT_LT(worst_share, 1e-7);
}

/// Worst error of the oscillator over a window, measured by a pulse at every sample: the lock-in of a pulse is the oscillator
/// times its code.
long double worst_of_oscillator(int cycles, int window) {
    constexpr std::int32_t kPulse = 1 << 22;
    long double worst = 0;
    const Oscillator oscillator(cycles, window);
    std::vector<Sample> samples(static_cast<std::size_t>(window));
    for (std::size_t n = 0; n < samples.size(); n += kChannels) {
        for (std::size_t c = 0; c < kChannels && n + c < samples.size(); ++c) {
            samples[n + c][c] = kPulse;
        }
        const auto sums = lock_in(oscillator, samples);
        for (std::size_t c = 0; c < kChannels && n + c < samples.size(); ++c) {
            const long double angle = -2 * std::numbers::pi_v<long double> * cycles * static_cast<long double>(n + c) /
                                      static_cast<long double>(window);
            const auto scale = std::ldexp(1.0L, -52);
            worst = std::max({worst, std::abs(static_cast<long double>(sums[c].re) * scale - std::cos(angle)),
                              std::abs(static_cast<long double>(sums[c].im) * scale - std::sin(angle))});
            samples[n + c][c] = 0;
        }
    }
    return worst;
}

TEST(FixedDemodulator, OscillatorStaysWithinTheStatedError) {
    long double worst = worst_of_oscillator(113, 757);
    for (int window = 16; window <= kMaxBlockSamples; window += 37) {
        for (const int cycles : {1, window / 7, window / 3, (window - 1) / 2}) {
            worst = std::max(worst, worst_of_oscillator(cycles, window));
        }
    }
    std::printf("oscillator: %.3Lg\n", worst);
    EXPECT_LT(worst, 8e-8L);
    EXPECT_GT(worst, 4e-8L);
}

/// Phasors of any size, against exact quotients.
TEST(FixedDemodulator, CouplingsStayWithinTheStatedError) {
    std::mt19937_64 random(43);
    const auto any = [&random](int bits) {
        return static_cast<std::int64_t>(random()) >> (2 + random() % static_cast<unsigned>(bits));
    };
    long double worst = 0;
    for (int n = 0; n < 300'000; ++n) {
        std::array<Phasor, kChannels> phasors;
        for (Phasor& phasor : phasors) {
            phasor = {any(30), any(30)};
        }
        const auto column = couplings(phasors, 200, 1);
        if (!column.ok()) {
            continue;
        }
        const long double re = static_cast<long double>(phasors[kReferenceChannel].re);
        const long double im = static_cast<long double>(phasors[kReferenceChannel].im);
        long double largest = 0;
        long double off = 0;
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            const auto i = static_cast<Index>(coil);
            const long double a = static_cast<long double>(phasors[coil].re);
            const long double b = static_cast<long double>(phasors[coil].im);
            const long double x = (a * re + b * im) / (re * re + im * im);
            const long double y = (b * re - a * im) / (re * re + im * im);
            largest = std::max({largest, std::abs(x), std::abs(y)});
            off = std::max({off, std::abs(std::ldexp(static_cast<long double>(column->in_phase(i)), column->exponent) - x),
                            std::abs(std::ldexp(static_cast<long double>(column->quadrature(i)), column->exponent) - y)});
        }
        worst = std::max(worst, off / largest);
    }
    std::printf("couplings: 2^%.2Lf of the largest\n", std::log2(worst));
    EXPECT_LT(worst, 0x1p-24L);
    EXPECT_GT(worst, 0x1p-26L);
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
    for (Index i = 0; i < 3; ++i) {
        EXPECT_NEAR(std::ldexp(column->in_phase(i), column->exponent), 1, 1e-8);
    }
}

TEST(FixedDemodulator, ReportsAMissingReference) {
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
