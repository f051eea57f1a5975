#include "drivers/stm32g4/gain_measurement.hpp"

#include <numbers>

#include "core/signal/block_health.hpp"
#include "core/signal/lock_in.hpp"
#include "drivers/stm32g4/acquisition.hpp"
#include "drivers/stm32g4/range_steps.hpp"
#include "drivers/stm32g4/staircase.hpp"

namespace tricoil::stm32g4 {
namespace {

using Phasors = signal::ChannelPhasors<float>;

constexpr std::uint8_t kTop = SensorAmplifiers::kSteps - 1;
constexpr float kOutputCodes = 1536;  // amplitude at the higher of the two gains: three quarters of the converter's range
/// Charging time of the feedback ladders' capacitors after power-on: ten time constants of 10 ms. Uses gain step 1, because with
/// higher gains the op-amp is at its rail and the capacitors do not charge.
constexpr Microseconds kFilling{100'000};
constexpr std::uint8_t kFillingStep = 1;
/// Blocks per reading for the comparison of step n. The gain of a step contains the errors of all comparisons below. With 4
/// blocks everywhere, noise alone causes errors of 0.1 per mille at gain 8.
constexpr int blocks_of(std::uint8_t n) { return n <= 3 ? 12 : 4; }
constexpr int kMostBlocks = 3;              // per block that a reading needs, before it times out
constexpr float kLinearShare = 0.95F;       // of full scale; linear range of the op-amps
constexpr int kOffsetDivisor = 5;           // largest offset: range / 5; the carrier uses 3/4 of full scale
constexpr float kTolerance = 0.1F;          // of the gain of a step, relative
constexpr float kShortestLag_s = 0.25e-6F;  // at the highest gain; bandwidth 40 MHz
constexpr float kLongestLag_s = 2.4e-6F;    // at the highest gain; bandwidth 4 MHz (typical: 13 MHz)
constexpr Status kOutOfTolerance{StatusCode::degenerate, "a sensor amplifier is out of tolerance"};

class Measurement {
public:
    Measurement(hal::CoilSampler& sampler, TestInputGain& gain, const signal::AcquisitionPlan& plan)
        : sampler_(sampler),
          gain_(gain),
          plan_(plan),
          oscillator_(plan.window_cycles[0], plan.window_samples),
          natural_run_(signal::longest_natural_run(plan.high_cycles(), plan.window_samples)) {}

    Status measure(signal::GainSteps<float>& steps) {
        if (plan_.window_cycles[0] * plan_.block_samples % plan_.window_samples != 0) {
            return {StatusCode::invalid_argument, "the carrier must have a whole number of cycles per block"};
        }
        Status status = fill();
        for (std::uint8_t n = 1; n <= kTop && status.ok(); ++n) {
            status = compare(n);
            for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
                steps[kDriveSteps + n].gain[coil] = std::abs(product_[coil]);
            }
        }
        return status.ok() ? separate(steps) : status;
    }

private:
    /// `step`: of the amplifiers.
    void choose(std::uint8_t step) { (void)gain_.choose(static_cast<std::uint8_t>(kDriveSteps + step)); }

    /// Starts sampling with the largest carrier that step n can amplify.
    Status start(std::uint8_t n) {
        gain_.set_test_carrier(kOutputCodes / SensorAmplifiers::gain_of(n));
        return sampler_.start(plan_);
    }

    Status fill() {
        choose(kFillingStep);
        Status status = start(kFillingStep);
        DeviceTime end = DeviceTime::max();
        while (status.ok() && block_.start < end) {
            status = sampler_.poll(block_);
            end = end == DeviceTime::max() ? block_.start + kFilling : end;
        }
        return status;
    }

    /// Compares step n with the step below.
    Status compare(std::uint8_t n) {
        Status status = start(n);
        for (auto step = static_cast<std::uint8_t>(n - 1); step <= n && status.ok(); ++step) {
            Phasors seen{};
            status = read(step, blocks_of(n), seen);
            for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
                product_[coil] =
                    step < n ? signal::divide(product_[coil], seen[coil]) : signal::multiply(product_[coil], seen[coil]);
            }
        }
        return status;
    }

    /// Sums the phasors of `wanted` blocks that were sampled with this step.
    Status read(std::uint8_t step, int wanted, Phasors& sum) {
        choose(step);
        int blocks = 0;
        for (int n = 0; n < kMostBlocks * wanted && blocks < wanted; ++n) {
            if (const Status polled = sampler_.poll(block_); !polled.ok()) {
                return polled;
            }
            if (block_.gain_step != step + kDriveSteps || block_.overrun_count > 0) {
                continue;
            }
            const auto window = block_.samples.subspan(static_cast<std::size_t>(plan_.params.guard_samples));
            const auto linear = static_cast<std::int32_t>(kLinearShare * static_cast<float>(block_.full_scale));
            if (!signal::inspect_window(window, natural_run_, linear, kOffsetDivisor).empty()) {
                return kOutOfTolerance;
            }
            add(lock_in(oscillator_, window), sum);
            ++blocks;
        }
        return blocks == wanted ? Status{} : Status{StatusCode::timed_out, "the amplifiers do not change their gain"};
    }

    static void add(const Phasors& seen, Phasors& sum) {
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            sum[coil] += seen[coil];
        }
    }

    /// Separates gain and lag in the measured responses.
    [[nodiscard]] Status separate(signal::GainSteps<float>& steps) const {
        constexpr auto kEdge_s = static_cast<float>(Acquisition::kTriggerTicks) / static_cast<float>(kFullSpeedHz);
        const float w_rad_s = 2 * std::numbers::pi_v<float> * static_cast<float>(plan_.params.carrier_hz[0]);
        const Staircase staircase{w_rad_s, kEdge_s, Converters::kSampling_s};
        constexpr float kTopGain = SensorAmplifiers::gain_of(kTop);
        const std::complex<float> ladder =
            signal::GainStep<float>{{kTopGain, kTopGain, kTopGain}}.response(0, w_rad_s, SensorAmplifiers::kLadder_s);
        bool is_in_tolerance = true;
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            const float top_lag_s = staircase.lag_of(signal::divide(product_[coil], ladder), kLongestLag_s);
            const float lag_s = top_lag_s / kTopGain;
            is_in_tolerance = is_in_tolerance && top_lag_s > kShortestLag_s && top_lag_s < 0.99F * kLongestLag_s;
            for (std::uint8_t n = 1; n <= kTop; ++n) {
                const float stated = SensorAmplifiers::gain_of(n);
                signal::GainStep<float>& step = steps[kDriveSteps + n];
                step.lag_s[coil] = lag_s * stated;
                step.gain[coil] /= std::abs(staircase.response(step.lag_s[coil]));
                is_in_tolerance = is_in_tolerance && std::abs(step.gain[coil] - stated) < kTolerance * stated;
            }
        }
        return is_in_tolerance ? Status{} : kOutOfTolerance;
    }

    hal::CoilSampler& sampler_;
    TestInputGain& gain_;
    const signal::AcquisitionPlan& plan_;
    signal::Oscillator<float> oscillator_;
    int natural_run_;
    SampleBlock block_;
    std::array<std::complex<float>, kSensorCoils> product_{{1, 1, 1}};  // response of a step relative to the follower
};

}  // namespace

Status measure_gain(hal::CoilSampler& sampler, TestInputGain& gain, const signal::AcquisitionPlan& plan,
                    signal::GainSteps<float>& steps) {
    const Status status = Measurement(sampler, gain, plan).measure(steps);
    sampler.stop();
    gain.set_test_carrier(0);
    return status;
}

}  // namespace tricoil::stm32g4
