// Gain measurement of amplifiers with gain and lag errors.
#include "drivers/stm32g4/gain_measurement.hpp"
#include "drivers/stm32g4/range_steps.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <vector>

#include "core/signal/stated_plan.hpp"
#include "drivers/stm32g4/acquisition.hpp"
#include "drivers/stm32g4/staircase.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr int kOversampling = 8;
constexpr auto kPlan = signal::stated_tdm_plan(Acquisition::sample_rate_hz(kOversampling), 100, 20, 12);
constexpr double kEdge_s = 296.0 / 170e6;
constexpr double kSampling_s = 47.5 / 42.5e6;  // sampling time of a conversion
constexpr double kLadder_s = 10e-3;            // 10 kOhm of the ladder, 1 uF
constexpr double kNoiseCodes = 0.6;            // standard deviation of a conversion
const double kCarrierRadS = 2 * std::numbers::pi * kPlan.params.carrier_hz[0];

struct Amplifier {
    std::array<double, SensorAmplifiers::kSteps> gain{1, 2, 4, 8, 16, 32, 64};
    double bandwidth_hz = 13e6;
    [[nodiscard]] double lag_s(std::size_t step) const {
        return std::pow(2.0, static_cast<double>(step)) / (2 * std::numbers::pi * bandwidth_hz);
    }
};

/// Simulates three amplifiers and their converters, one conversion at a time.
class FedAmplifiers final : public hal::CoilSampler, public TestInputGain {
public:
    std::array<Amplifier, kSensorCoils> amplifiers;
    bool obeys = true;
    std::uint32_t overruns = 0;  // reported in every second block, whose samples are corrupted
    Status status;
    int starts = 0;
    float fed = 0;
    bool runs = false;

private:
    [[nodiscard]] std::uint8_t do_steps() const override { return kRangeSteps; }
    Status do_choose(std::uint8_t step) override {
        wanted_ = obeys ? amplifier_step(step) : wanted_;
        return {};
    }
    Status do_measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) override {
        return measure_gain(*this, *this, plan, steps);
    }
    void do_set_test_carrier(float amplitude_codes) override { fed = amplitude_codes; }

    Status do_start(const signal::AcquisitionPlan&) override {
        ++starts;
        runs = true;
        amplitude_ = static_cast<double>(fed);
        step_ = wanted_;
        return {};
    }
    void do_stop() override { runs = false; }

    Status do_poll(SampleBlock& block) override {
        samples_.assign(static_cast<std::size_t>(kPlan.block_samples), Sample{});
        for (Sample& sample : samples_) {
            for (int n = 0; n < kOversampling; ++n) {
                convert(sample);
            }
        }
        block.overrun_count = polls_++ % 2 == 1 ? overruns : 0;
        if (block.overrun_count > 0) {
            samples_[50][0] += 9000;
        }
        block.full_scale = 2047 * kOversampling;
        block.gain_step = static_cast<std::uint8_t>(kDriveSteps + step_);
        block.samples = samples_;
        block.start = device_time_us(static_cast<std::int64_t>(1e6 * kEdge_s * static_cast<double>(edges_)));
        step_ = wanted_;
        return status;
    }

    void convert(Sample& sample) {
        const double played = std::round(amplitude_ * std::sin(kCarrierRadS * kEdge_s * static_cast<double>(edges_++)));
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            const double lag_s = amplifiers[coil].lag_s(step_);
            double& output = output_[coil];
            output = last_[coil] + (output - last_[coil]) * std::exp(-(kEdge_s - kSampling_s) / lag_s);
            capacitor_[coil] += (played - capacitor_[coil]) * kEdge_s / kLadder_s;
            last_[coil] = played + (amplifiers[coil].gain[step_] - 1) * (played - capacitor_[coil]);
            output = last_[coil] + (output - last_[coil]) * std::exp(-kSampling_s / lag_s);
            const double code = output + kNoiseCodes * normal_(random_);
            sample[coil] += static_cast<std::int32_t>(std::lround(std::clamp(code, -2048.0, 2047.0)));
        }
    }

    std::uint8_t wanted_ = 0;
    std::uint8_t step_ = 0;
    double amplitude_ = 0;
    std::int64_t edges_ = 0;
    int polls_ = 0;
    std::array<double, kSensorCoils> capacitor_{};  // voltage at the end of the ladder
    std::array<double, kSensorCoils> last_{};
    std::array<double, kSensorCoils> output_{};
    std::vector<Sample> samples_;
    std::mt19937 random_{1};
    std::normal_distribution<double> normal_{0, 1};
};

TEST(Staircase, EqualsTheStepResponseOfAPole) {
    const auto w = static_cast<float>(kCarrierRadS);
    const Staircase staircase{w, static_cast<float>(kEdge_s), static_cast<float>(kSampling_s)};
    for (const double lag_s : {0.05e-6, 0.4e-6, 0.8e-6, 2e-6}) {
        std::complex<double> seen = 0;
        double output = 0;
        double last = 0;
        constexpr int kEdges = 1600;  // 30 whole cycles
        for (int n = -kEdges; n < kEdges; ++n) {
            output = last + (output - last) * std::exp(-(kEdge_s - kSampling_s) / lag_s);
            last = std::cos(kCarrierRadS * kEdge_s * n);
            output = last + (output - last) * std::exp(-kSampling_s / lag_s);
            seen += n < 0 ? 0 : output * std::polar(2.0 / kEdges, -kCarrierRadS * kEdge_s * n);
        }
        const auto response = static_cast<std::complex<double>>(staircase.response(static_cast<float>(lag_s)));
        EXPECT_NEAR(response.real(), seen.real(), 2e-6) << lag_s;
        EXPECT_NEAR(response.imag(), seen.imag(), 2e-6) << lag_s;
    }
}

TEST(Staircase, RecoversTheLag) {
    const Staircase staircase{static_cast<float>(kCarrierRadS), static_cast<float>(kEdge_s), static_cast<float>(kSampling_s)};
    for (const float lag_s : {0.3e-6F, 0.8e-6F, 2e-6F}) {
        EXPECT_NEAR(staircase.lag_of(60.0F * staircase.response(lag_s), 3e-6F) / lag_s, 1, 1e-3) << lag_s;
    }
}

/// Accuracy 1e-3: a carrier of few DAC codes has harmonics, and the 19th and 21st alias onto the carrier when eight conversions
/// are added to one sample.
TEST(GainMeasurement, MeasuresEveryStep) {
    FedAmplifiers fed;
    fed.amplifiers[0] = {{1, 2.03, 3.95, 8.1, 15.8, 32.6, 62.9}, 10e6};
    fed.amplifiers[1] = {{1, 1.97, 4.06, 7.9, 16.3, 31.5, 65.1}, 16e6};
    signal::GainSteps<float> steps{};
    ASSERT_TRUE(measure_gain(fed, fed, kPlan, steps).ok());
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        EXPECT_EQ(steps[kDriveSteps].gain[coil], 1);
        for (std::size_t n = 1; n < SensorAmplifiers::kSteps; ++n) {
            EXPECT_NEAR(static_cast<double>(steps[kDriveSteps + n].gain[coil]) / fed.amplifiers[coil].gain[n], 1, 1e-3)
                << coil << ", " << n;
            EXPECT_NEAR(static_cast<double>(steps[kDriveSteps + n].lag_s[coil]) / fed.amplifiers[coil].lag_s(n), 1, 0.05)
                << coil << ", " << n;
        }
    }
    EXPECT_EQ(fed.fed, 0) << "the inputs must be the sensor coils again";
    EXPECT_FALSE(fed.runs);
}

TEST(GainMeasurement, SkipsBlocksThatLostSamples) {
    FedAmplifiers fed;
    fed.overruns = 1;
    signal::GainSteps<float> steps{};
    ASSERT_TRUE(measure_gain(fed, fed, kPlan, steps).ok());
    EXPECT_NEAR(static_cast<double>(steps[kDriveSteps + 6].gain[0]), 64, 0.064);
}

StatusCode result_of(FedAmplifiers& fed, const signal::AcquisitionPlan& plan = kPlan) {
    signal::GainSteps<float> steps{};
    const StatusCode code = measure_gain(fed, fed, plan, steps).code();
    EXPECT_EQ(fed.fed, 0) << "the inputs must be the sensor coils again";
    EXPECT_FALSE(fed.runs);
    return code;
}

TEST(GainMeasurement, RefusesABrokenLadder) {
    for (const double gain : {1.0, 25.0, 36.0}) {  // gain 1: the capacitor of the ladder is missing
        FedAmplifiers fed;
        fed.amplifiers[2].gain[5] = gain;
        EXPECT_EQ(result_of(fed), StatusCode::degenerate) << gain;
    }
}

TEST(GainMeasurement, RefusesAnAmplifierThatIsTooSlowOrTooFast) {
    for (const double bandwidth_hz : {3e6, 60e6}) {
        FedAmplifiers fed;
        fed.amplifiers[0].bandwidth_hz = bandwidth_hz;
        EXPECT_EQ(result_of(fed), StatusCode::degenerate) << bandwidth_hz;
    }
}

TEST(GainMeasurement, RefusesADeadOrSaturatedChannel) {
    FedAmplifiers dead;
    dead.amplifiers[1].gain.fill(0);
    EXPECT_EQ(result_of(dead), StatusCode::degenerate);
    FedAmplifiers full;
    full.amplifiers[1].gain.fill(10);
    EXPECT_EQ(result_of(full), StatusCode::degenerate);
}

TEST(GainMeasurement, RefusesACarrierThatEndsWithinABlock) {
    FedAmplifiers fed;
    EXPECT_EQ(result_of(fed, signal::stated_tdm_plan(Acquisition::sample_rate_hz(kOversampling), 50, 10, 6)),
              StatusCode::invalid_argument);
    EXPECT_EQ(fed.starts, 0);
}

TEST(GainMeasurement, ReturnsErrorsOfConvertersAndAmplifiers) {
    for (const StatusCode code : {StatusCode::timed_out, StatusCode::over_current, StatusCode::device_lost}) {
        FedAmplifiers fed;
        fed.status = {code, "no block"};
        EXPECT_EQ(result_of(fed), code);
    }
    FedAmplifiers stubborn;
    stubborn.obeys = false;
    EXPECT_EQ(result_of(stubborn), StatusCode::timed_out);
}

}  // namespace
}  // namespace tricoil::stm32g4
