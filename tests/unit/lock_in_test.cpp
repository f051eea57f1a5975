#include "core/signal/lock_in.hpp"

#include <gtest/gtest.h>

#include "core/signal/noise_estimate.hpp"
#include "core/signal/unit_phasor.hpp"
#include "tests/support/tones.hpp"

namespace tricoil::signal {
namespace {

AcquisitionPlan plan_of(Multiplexing multiplexing) { return *plan_acquisition(default_acquisition(multiplexing, 240)); }

TEST(UnitPhasor, EqualsTheLibraryToTheLastBits) {
    double worst = 0;
    for (int window = 3; window < 400; ++window) {
        for (int n = 0; n < window; ++n) {
            const double part = static_cast<double>(n) / window;
            const auto exact = std::polar(1.0L, -2 * std::numbers::pi_v<long double> * part);
            worst = std::max(worst, static_cast<double>(std::abs(std::complex<long double>(unit_phasor(part)) - exact)));
        }
    }
    EXPECT_LT(worst, 3e-16);
    EXPECT_GT(worst, 1e-17);
    EXPECT_EQ(unit_phasor(0), (std::complex<double>{1, 0}));
    EXPECT_EQ(unit_phasor(0.25).real(), 0);
}

template <typename Scalar>
class LockIn : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LockIn, Scalars);

TYPED_TEST(LockIn, OscillatorFollowsTheExactPhasor) {
    const Oscillator<TypeParam> oscillator(42, 600);
    std::complex<TypeParam> phasor;
    for (int n = 0; n < 600; ++n) {
        phasor = n % kSegmentSamples == 0 ? oscillator.at_segment(n / kSegmentSamples) : phasor * oscillator.step();
        const std::complex<double> exact = std::polar(1.0, -2 * std::numbers::pi * 42 * n / 600);
        EXPECT_LT(std::abs(std::complex<double>(phasor) - exact), sizeof(TypeParam) == 4 ? 2e-6 : 1e-13);
    }
}

TYPED_TEST(LockIn, MeasuresAmplitudeAndPhaseDespiteOffsetAndOtherCarriers) {
    const auto plan = plan_of(Multiplexing::fdm);
    test::ToneBlock block;
    block.tones[0] = {{{3e6, 0.3}, {2e6, -1.0}, {1e6, 2.5}}};
    block.offset.fill(4e5);
    std::mt19937_64 random(1);
    const auto samples = test::render(block, plan, random);
    for (std::size_t j = 0; j < 3; ++j) {
        const Oscillator<TypeParam> oscillator(plan.window_cycles[j], plan.window_samples);
        const auto phasors = lock_in<TypeParam>(oscillator, samples);
        const auto exact = std::polar(block.tones[0][j].amplitude, block.tones[0][j].phase_rad);
        // Codes are rounded: 0.29 sqrt(2/300) = 0.024 for each part, because the three carriers repeat after 300 samples. The
        // limit is five times that.
        EXPECT_LT(std::abs(std::complex<double>(phasors[0]) - exact), sizeof(TypeParam) == 4 ? 6.0 : 0.12) << j;
        EXPECT_LT(std::abs(phasors[1]), 2.0);  // channel with an offset and no carrier
    }
}

TYPED_TEST(LockIn, HumIsRemoved) {
    const auto plan = plan_of(Multiplexing::fdm);
    test::ToneBlock block;
    block.hum = 1e5;
    block.tones[1] = {{{3e6, 0.3}, {2e6, -1.0}, {1e6, 2.5}}};
    std::mt19937_64 random(2);
    const auto samples = test::render(block, plan, random);
    std::vector<Oscillator<TypeParam>> oscillators;
    std::vector<ChannelPhasors<TypeParam>> carriers;
    for (std::size_t j = 0; j < 3; ++j) {
        oscillators.emplace_back(plan.window_cycles[j], plan.window_samples);
        carriers.push_back(lock_in<TypeParam>(oscillators.back(), samples));
    }
    const auto step = hum_step<TypeParam>(oscillators, carriers, samples);
    for (std::size_t j = 0; j < 3; ++j) {
        const auto hum = hum_leakage<TypeParam>(oscillators[j], step, samples.size());
        EXPECT_GT(std::abs(carriers[j][0]), 100);
        EXPECT_LT(std::abs(carriers[j][0] - hum[0]), std::abs(carriers[j][0]) / 50);
        const auto exact = std::polar(block.tones[1][j].amplitude, block.tones[1][j].phase_rad);
        EXPECT_LT(std::abs(std::complex<double>(carriers[j][1] - hum[1]) - exact), 8);
    }
}

TYPED_TEST(LockIn, NoiseIsMeasuredDespiteSignalOffsetAndRamp) {
    for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm}) {
        const auto plan = plan_of(multiplexing);
        test::ToneBlock block;
        block.noise = 30;
        block.offset.fill(1e5);
        for (auto& channel : block.tones) {
            channel = {{{4e6, 0.1}, {0, 0}, {0, 0}}};
        }
        const NoiseEstimator<TypeParam> estimator(plan);
        std::mt19937_64 random(3);
        double power = 0;
        constexpr int kBlocks = 50;
        for (int i = 0; i < kBlocks; ++i) {
            const auto sigma = estimator.sample_sigma(test::render(block, plan, random));
            power += static_cast<double>(sigma[2] * sigma[2]) / kBlocks;
        }
        EXPECT_NEAR(std::sqrt(power), 30, 1.5);
    }
}

}  // namespace
}  // namespace tricoil::signal
