#include "core/signal/demodulator.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/approx.hpp"
#include "tests/support/tones.hpp"

namespace tricoil::signal {
namespace {

constexpr double kFullScale = 8388607;

/// Blocks in which the sensor coils carry given couplings (relative to the reference) at given channel phases.
class DemodulatorTest : public ::testing::Test {
protected:
    SampleBlock block(const AcquisitionPlan& plan, Excitation state, const test::ToneBlock& tones) {
        samples_ = test::render(tones, plan, random_, first_);
        first_ += plan.block_samples;
        SampleBlock b;
        b.state = state;
        b.full_scale = static_cast<std::int32_t>(kFullScale);
        b.scale = static_cast<float>(2.5 / kFullScale);
        b.start = device_time_us(1'000'000);
        b.sequence = sequence_++;
        b.samples = samples_;
        return b;
    }

    static test::ToneBlock coupled(const Vec3<double>& couplings, const Vec3<double>& phases, double reference = 3e6) {
        test::ToneBlock tones;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto i = static_cast<Index>(c);
            tones.tones[c][0] = {reference * couplings(i), phases(i) + 0.7};
        }
        tones.tones[3][0] = {reference, 0.7};
        return tones;
    }

    const AcquisitionPlan tdm_ = *plan_acquisition(default_acquisition(Multiplexing::tdm, 240));
    const AcquisitionPlan fdm_ = *plan_acquisition(default_acquisition(Multiplexing::fdm, 240));
    std::mt19937_64 random_{4};
    std::vector<Sample> samples_;
    long first_ = 0;
    std::uint32_t sequence_ = 0;
};

TEST_F(DemodulatorTest, TdmGivesOneSignedColumnAtTheWindowsMidpoint) {
    Demodulator<double> demodulator(tdm_, {});
    const auto columns = demodulator.demodulate(block(tdm_, Excitation::s2, coupled({0.5, -0.25, 0.125}, {0, 0, 0})));
    ASSERT_TRUE(columns.ok());
    ASSERT_EQ(columns->size(), 1U);
    const auto& column = (*columns)[0];
    EXPECT_EQ(column.state, Excitation::s2);
    EXPECT_TRUE(is_approx(column.in_phase, Vec3<double>(0.5, -0.25, 0.125), 1e-6));
    EXPECT_LT(column.quadrature.norm(), 1e-6);
    const double middle = (40 + 79.5) / 144e3;
    EXPECT_NEAR(to_seconds(column.midpoint), 1.0 + middle, 1e-6);
    EXPECT_TRUE(column.flags.empty());
}

/// The definition: a sine through a characteristic with jumps.
TEST(ConverterErrors, AJumpChangesTheAmplitudeOfALargerSine) {
    ConverterErrors errors;
    errors.jump[1] = {40, 0, 0, -30, 0, 0, 0, 0, 25, 0, 0, 0, 0, 60};
    constexpr int kPoints = 200'000;
    for (const double amplitude : {0.05, 0.2, 0.4, 0.6, 0.84}) {
        double sum = 0;
        for (int k = 0; k < kPoints; ++k) {
            const double sine = std::sin(2 * std::numbers::pi * (k + 0.5) / kPoints);
            double code = amplitude * sine;
            for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
                const double height = static_cast<double>(ConverterErrors::kJumpUnit) * errors.jump[1][n];
                const double side = static_cast<double>(n) / 16;
                for (const double level : {side, -side}) {  // half of the height each
                    code += (amplitude * sine > level ? 0.25 : -0.25) * height;
                }
            }
            sum += code * sine;
        }
        const double error = 2 * sum / kPoints - amplitude;
        EXPECT_NEAR(static_cast<double>(errors.amplitude_error(1, static_cast<float>(amplitude))), error, 1e-3 * 5e-4)
            << amplitude;
        EXPECT_EQ(errors.amplitude_error(0, static_cast<float>(amplitude)), 0);
    }
    EXPECT_EQ(ConverterErrors{}.correction(0, 0, 0, true), 1);
}

TEST_F(DemodulatorTest, CorrectsConvertersInTdmAndGainStepsAlways) {
    DemodulatorParams<double> params;
    params.converters.gain[0] = {82, 0, 0};  // 0.5 %
    params.converters.jump[1].fill(127);
    for (const AcquisitionPlan& plan : {tdm_, fdm_}) {
        const Excitation state = plan.is_tdm() ? Excitation::s1 : Excitation::all;
        const auto columns =
            Demodulator<double>(plan, params).demodulate(block(plan, state, coupled({0.5, -0.25, 0.125}, {0, 0, 0})));
        ASSERT_TRUE(columns.ok());
        const MeasuredColumn<double>& column = (*columns)[0];
        const auto level = static_cast<float>(0.25 * 3e6 / kFullScale);
        const double error = plan.is_tdm() ? static_cast<double>(params.converters.amplitude_error(1, level) / level) : 0;
        EXPECT_NEAR(column.in_phase(0), 0.5 * (1 - 82.0 / 16384), 1e-6);
        EXPECT_NEAR(column.in_phase(1), -0.25 * (1 - error), 1e-6);
        EXPECT_NEAR(column.in_phase(2), 0.125, 1e-6);
        EXPECT_EQ(error > 1e-3, plan.is_tdm());
        EXPECT_EQ(column.level[1], 0) << "corrected";
    }
}

/// Each sample is the sum of some conversions, whose amplitude is larger than that of their mean.
TEST_F(DemodulatorTest, LevelsAreAmplitudesOfConversionsInTdm) {
    DemodulatorParams<float> params;
    params.conversions = 8;
    const auto tones = coupled({0.5, -0.25, 0.125}, {0, 0, 0});
    const auto in_tdm = Demodulator<float>(tdm_, params).demodulate(block(tdm_, Excitation::s1, tones));
    ASSERT_TRUE(in_tdm.ok());
    const double x = std::numbers::pi * tdm_.params.carrier_hz[0] / (8 * tdm_.params.sample_rate_hz);
    const double mean = std::sin(8 * x) / (8 * std::sin(x));
    for (std::size_t i = 0; i < 3; ++i) {
        const double expected = 65536 * std::ldexp(3e6, -1 - static_cast<int>(i)) / kFullScale / mean;
        EXPECT_NEAR((*in_tdm)[0].level[i], expected, 2) << i;
    }
    const auto in_fdm = Demodulator<float>(fdm_, params).demodulate(block(fdm_, Excitation::all, tones));
    ASSERT_TRUE(in_fdm.ok());
    EXPECT_EQ((*in_fdm)[0].level[0], 0) << "several carriers";
}

TEST_F(DemodulatorTest, FdmGivesThreeColumnsWithTheSameTime) {
    test::ToneBlock tones;
    for (std::size_t j = 0; j < 3; ++j) {
        tones.tones[3][j] = {1e6, 0.2};
        tones.tones[0][j] = {1e5 * static_cast<double>(j + 1), 0.2};
        tones.tones[1][j] = {-2e5, 0.2};
    }
    Demodulator<float> demodulator(fdm_, {});
    const auto columns = demodulator.demodulate(block(fdm_, Excitation::all, tones));
    ASSERT_TRUE(columns.ok());
    ASSERT_EQ(columns->size(), 3U);
    for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_EQ((*columns)[j].state, single_coil(static_cast<int>(j)));
        EXPECT_EQ((*columns)[j].midpoint, (*columns)[0].midpoint);
        EXPECT_NEAR((*columns)[j].in_phase(0), 0.1F * static_cast<float>(j + 1), 1e-5F);
        EXPECT_NEAR((*columns)[j].in_phase(1), -0.2F, 1e-5F);
    }
}

TEST_F(DemodulatorTest, TwoBandsGiveSixColumnsWithTheirNoise) {
    const AcquisitionPlan plan = *plan_acquisition(default_acquisition(Multiplexing::dual_band, 240));
    test::ToneBlock tones;
    tones.noise = 200;
    const auto coupling = [](std::size_t carrier) { return 0.1 * static_cast<double>(carrier + 1); };
    for (std::size_t j = 0; j < kMaxCarriers; ++j) {
        tones.tones[3][j] = {5e5, 0.2};
        tones.tones[0][j] = {5e5 * coupling(j), 0.2};
    }
    Demodulator<double> demodulator(plan, {});
    std::array<double, kMaxCarriers> squares{};
    std::array<double, kMaxCarriers> sigma{};
    constexpr int kBlocks = 300;
    for (int i = 0; i < kBlocks; ++i) {
        const auto columns = demodulator.demodulate(block(plan, Excitation::all, tones));
        ASSERT_TRUE(columns.ok());
        ASSERT_EQ(columns->size(), 6U);
        for (std::size_t j = 0; j < columns->size(); ++j) {
            const Column<double>& column = (*columns)[j];
            EXPECT_EQ(column.state, single_coil(static_cast<int>(j % 3)));
            EXPECT_EQ(column.flags.has(ColumnFlag::low_band), j >= 3);
            EXPECT_EQ(column.midpoint, (*columns)[0].midpoint);
            squares[j] += std::pow(column.in_phase(0) - coupling(j), 2) / kBlocks;
            sigma[j] += column.sigma(0) / kBlocks;
        }
    }
    for (std::size_t j = 0; j < kMaxCarriers; ++j) {
        EXPECT_NEAR(sigma[j] / std::sqrt(squares[j]), 1, 0.15) << j;  // standard error of the scatter: 0.04
    }
}

TEST_F(DemodulatorTest, HumVanishesFromTheMeanOfTheLowBand) {
    const AcquisitionPlan plan = *plan_acquisition(default_acquisition(Multiplexing::dual_band, 240));
    test::ToneBlock tones;
    tones.hum = 1e4;
    for (std::size_t j = 0; j < kMaxCarriers; ++j) {
        tones.tones[3][j] = {5e5, 0.2};
        tones.tones[0][j] = {5e4, 0.2};
    }
    Demodulator<double> demodulator(plan, {});
    Vec3<double> mean = Vec3<double>::Zero();
    double largest = 0;
    constexpr int kBlocks = 24;  // 0.1 s: five cycles of 50 Hz
    for (int i = 0; i < kBlocks; ++i) {
        const auto columns = demodulator.demodulate(block(plan, Excitation::all, tones));
        for (std::size_t j = 0; j < kSourceCoils; ++j) {
            const double coupling = (*columns)[kSourceCoils + j].in_phase(0);
            mean(static_cast<Index>(j)) += coupling / kBlocks;
            largest = std::max(largest, std::abs(coupling - 0.1));
        }
    }
    EXPECT_GT(largest, 1e-4);  // in single blocks
    // The test's reference channel has hum too: an effect of second order.
    EXPECT_LT((mean - Vec3<double>::Constant(0.1)).cwiseAbs().maxCoeff(), 0.02 * largest);
}

TEST_F(DemodulatorTest, SigmaEqualsTheScatterOfTheCouplings) {
    auto tones = coupled({0.5, -0.25, 0.125}, {0, 0, 0});
    tones.noise = 100;
    Demodulator<double> demodulator(tdm_, {});
    Vec3<double> squares = Vec3<double>::Zero();
    Vec3<double> estimated = Vec3<double>::Zero();
    constexpr int kBlocks = 400;
    for (int i = 0; i < kBlocks; ++i) {
        const auto columns = demodulator.demodulate(block(tdm_, Excitation::s1, tones));
        squares += ((*columns)[0].in_phase - Vec3<double>(0.5, -0.25, 0.125)).cwiseAbs2() / kBlocks;
        estimated += (*columns)[0].sigma / kBlocks;
    }
    for (Index i = 0; i < 3; ++i) {
        EXPECT_NEAR(estimated(i) / std::sqrt(squares(i)), 1, 0.12);  // standard error of the scatter: 0.035
    }
}

TEST_F(DemodulatorTest, TheResponseOfTheChannelsMakesCouplingsReal) {
    const Vec3<double> phases(0.5, 0.62, 0.41);
    const Vec3<double> couplings(0.5, -0.25, 0.3);
    DemodulatorParams<double> params;
    for (std::size_t c = 0; c < 3; ++c) {
        params.response[0][c] = std::polar(1.0, phases(static_cast<Index>(c)));
    }
    Demodulator<double> calibrated(tdm_, params);
    const auto column = (*calibrated.demodulate(block(tdm_, Excitation::s1, coupled(couplings, phases))))[0];
    EXPECT_TRUE(is_approx(column.in_phase, couplings, 1e-5));
    EXPECT_LT(column.quadrature.norm(), 1e-5);
}

TEST_F(DemodulatorTest, FlagsFaultySamples) {
    const auto flags = [&](const test::ToneBlock& tones, auto spoil) {
        Demodulator<double> demodulator(tdm_, {});
        SampleBlock b = block(tdm_, Excitation::s1, tones);
        spoil(samples_);
        return (*demodulator.demodulate(b))[0].flags;
    };
    const auto nothing = [](auto&) {};
    const auto good = coupled({0.5, -0.25, 0.125}, {0, 0, 0});
    EXPECT_TRUE(flags(good, nothing).empty());

    EXPECT_TRUE(flags(good, [](auto& s) { s[100][1] = 8388607; }).has(ColumnFlag::saturated));
    EXPECT_TRUE(flags(good, [](auto& s) {
                    for (auto& sample : s) {
                        sample[0] = std::clamp(sample[0], -1'200'000, 1'200'000);
                    }
                }).has(ColumnFlag::clipped));
    EXPECT_TRUE(flags(good, [](auto& s) {
                    for (auto& sample : s) {
                        sample[2] = 77;
                    }
                }).has(ColumnFlag::stuck));
    auto offset = good;
    offset.offset[1] = 3e6;
    EXPECT_TRUE(flags(offset, nothing).has(ColumnFlag::dc_offset));
    EXPECT_TRUE(flags(coupled({0.5, 0.5, 0.5}, {0, 0, 0}, 100), nothing).has(ColumnFlag::no_reference));
    auto weak = coupled({1e-6, -1e-6, 1e-6}, {0, 0, 0});
    weak.noise = 300;
    EXPECT_TRUE(flags(weak, nothing).has(ColumnFlag::low_signal));
}

TEST_F(DemodulatorTest, ASineIsNotFlaggedAsClippedAtAnyPhase) {
    for (const auto& plan : {tdm_, fdm_}) {
        Demodulator<double> demodulator(plan, {});
        for (double phase = 0; phase < 6.3; phase += 0.05) {
            test::ToneBlock tones;
            for (auto& channel : tones.tones) {
                channel = {{{2e6, phase}, {plan.is_tdm() ? 0 : 2e6, 2 * phase}, {plan.is_tdm() ? 0 : 2e6, 0.1}}};
            }
            const auto columns = demodulator.demodulate(block(plan, plan.is_tdm() ? Excitation::s1 : Excitation::all, tones));
            EXPECT_FALSE((*columns)[0].flags.has(ColumnFlag::clipped)) << phase;
        }
    }
}

TEST_F(DemodulatorTest, RefusesBlocksThatDoNotFitThePlan) {
    Demodulator<double> demodulator(tdm_, {});
    auto b = block(tdm_, Excitation::off, {});
    EXPECT_EQ(demodulator.demodulate(b).status().code(), StatusCode::invalid_argument);
    b.state = Excitation::all;
    EXPECT_EQ(demodulator.demodulate(b).status().code(), StatusCode::invalid_argument);
    b.state = Excitation::s1;
    b.samples = b.samples.first(100);
    EXPECT_EQ(demodulator.demodulate(b).status().code(), StatusCode::invalid_argument);
    b.samples = {};
    EXPECT_EQ(demodulator.demodulate(b).status().code(), StatusCode::invalid_argument);
}

TEST_F(DemodulatorTest, AGainStepIsCorrectedAndItsFirstFdmBlockIsFlagged) {
    DemodulatorParams<double> params;
    params.gain_steps[1].gain = {4, 2, 8};
    Demodulator<double> demodulator(fdm_, params);
    auto b = block(fdm_, Excitation::all, coupled({0.04, -0.02, 0.01}, {0, 0, 0}));
    const Vec3<double> before = (*demodulator.demodulate(b))[0].in_phase;
    b.gain_step = 1;
    EXPECT_TRUE((*demodulator.demodulate(b))[0].flags.has(ColumnFlag::gain_changed));
    const auto after = (*demodulator.demodulate(b))[0];
    EXPECT_FALSE(after.flags.has(ColumnFlag::gain_changed));
    EXPECT_LT((after.in_phase.cwiseProduct(Vec3<double>(4, 2, 8)) - before).norm(), 1e-12);
    b.gain_step = kMaxGainSteps;
    EXPECT_EQ(demodulator.demodulate(b).status().code(), StatusCode::invalid_argument);
}

TEST_F(DemodulatorTest, ABlockOfZerosIsFlaggedAsNoSignal) {
    Demodulator<float> demodulator(fdm_, {});
    const auto columns = demodulator.demodulate(block(fdm_, Excitation::all, {}));
    ASSERT_TRUE(columns.ok());
    EXPECT_TRUE((*columns)[0].flags.has(ColumnFlag::no_reference));
    EXPECT_TRUE((*columns)[0].in_phase.isZero(0));
    EXPECT_GT((*columns)[0].sigma.minCoeff(), 0);
}

TEST_F(DemodulatorTest, SigmaNeverFallsBelowItsFloor) {
    DemodulatorParams<double> params;
    params.sigma_floor = 1e-3;
    Demodulator<double> demodulator(tdm_, params);
    const auto columns = demodulator.demodulate(block(tdm_, Excitation::s1, coupled({0.5, -0.25, 0.125}, {0, 0, 0})));
    EXPECT_DOUBLE_EQ((*columns)[0].sigma.minCoeff(), 1e-3);
}

TEST(GainStep, HasTheResponseOfAmplifierAndLadder) {
    using Complex = std::complex<double>;
    GainStep<double> step;
    step.gain = {8, 8, 8};
    step.lag_s.fill(1e-7);
    for (const double ladder_s : {0.0, 10e-3}) {
        for (const double hz : {480.0, 10e3}) {
            const Complex iw(0, 2 * std::numbers::pi * hz);
            const Complex ladder = ladder_s > 0 ? iw * ladder_s / (1.0 + iw * ladder_s) : 1.0;
            const Complex expected = (1.0 + 7.0 * ladder) / (1.0 + iw * 1e-7);
            EXPECT_LT(std::abs(step.response(1, iw.imag(), ladder_s) - expected), 1e-12) << hz;
        }
    }
}

}  // namespace
}  // namespace tricoil::signal
