// One on-chip op-amp before the converter of a sensor channel, with production tolerances.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace tricoil::virtual_board {

/// A gain ladder with tolerances, one pole whose frequency falls with the gain, output rails, and the capacitor at the ground end
/// of the ladder. Voltages are relative to half the supply.
class SensorAmplifier {
public:
    /// Gains 2, 4, ... 64.
    static constexpr std::size_t kLadderSteps = 6;

    SensorAmplifier() = default;
    /// Ladder within 2 %, bandwidth within 25 % of 13 MHz (DS12288: typical).
    explicit SensorAmplifier(std::mt19937_64& random) {
        std::uniform_real_distribution<double> unit(-1, 1);
        for (double& error : ladder_error) {
            error = 0.02 * unit(random);
        }
        bandwidth_hz *= 1 + 0.25 * unit(random);
    }

    /// True gain for a nominal gain of 1, 2, 4, ... 64.
    [[nodiscard]] double gain(double nominal) const {
        return nominal < 2 ? 1 : nominal * (1 + ladder_error[static_cast<std::size_t>(std::lround(std::log2(nominal))) - 1]);
    }

    /// The input moved on a parabola through its last two samples and this one; after a step of another length in a straight
    /// line. Straight lines would make the response to a carrier of 13 kHz 1.7 per mille too small at the highest gain;
    /// parabolas 0.01.
    void follow(double input_v, double nominal, double step_s) {
        const double lag_s = update_input(input_v, nominal, step_s);
        const double second_difference_v = step_s == step_s_ ? input_v - 2 * inputs_v_[0] + inputs_v_[1] : 0;
        const double bend = (1 + ladder(nominal)) * second_difference_v / (step_s * step_s);
        const double slope = (next_v_ - driven_v_) / step_s;  // mean of the step
        const auto steady_v = [&](double volts, double slope_there) { return volts - lag_s * (slope_there - lag_s * bend); };
        const double transient_v = output_v_ - steady_v(driven_v_, slope - bend * step_s / 2);
        output_v_ = steady_v(next_v_, slope + bend * step_s / 2) + transient_v * std::exp(-step_s / lag_s);
        driven_v_ = next_v_;
        inputs_v_ = {input_v, inputs_v_[0]};
        step_s_ = step_s;
    }

    /// The input jumped `held_s` ago.
    void jump(double input_v, double nominal, double step_s, double held_s) {
        const double lag_s = update_input(input_v, nominal, step_s);
        output_v_ = driven_v_ + (output_v_ - driven_v_) * std::exp(-std::max(step_s - held_s, 0.0) / lag_s);
        output_v_ = next_v_ + (output_v_ - next_v_) * std::exp(-held_s / lag_s);
        driven_v_ = next_v_;
        step_s_ = 0;
    }

    /// Noise of the op-amp at the converter, in volts: white at the input, limited by the pole; the part beyond half the
    /// conversion rate is aliased.
    [[nodiscard]] double noise_v(double nominal) const {
        return kNoiseV_rthz * nominal * std::sqrt(std::numbers::pi / 2 * bandwidth_hz / nominal);
    }

    [[nodiscard]] double output_v() const { return std::clamp(output_v_, -kRailV, kRailV); }
    void lose_power() {
        capacitor_v_ = -kHalfSupplyV;  // empty
        next_v_ = driven_v_ = output_v_ = 0;
        step_s_ = 0;
    }

    std::array<double, kLadderSteps> ladder_error{};
    double bandwidth_hz = 13e6;
    bool has_capacitor = true;
    double filling_s = 10e-3;  // time constant: 10 kOhm of the ladder, 1 uF

private:
    static constexpr double kHalfSupplyV = 1.65;
    static constexpr double kNoiseV_rthz = 100e-9;  // assumed by HARDWARE.md
    static constexpr double kRailV = kHalfSupplyV - 0.05;
    static constexpr double kLongestStepS = 5e-6;  // limit of the charging time per sample; without samples the ladder may be off

    /// Amplification of the difference between input and capacitor, in addition to the input.
    [[nodiscard]] double ladder(double nominal) const { return has_capacitor ? gain(nominal) - 1 : 0; }

    /// Returns the lag. The ladder amplifies the difference between input and capacitor. The output charges the capacitor through
    /// the whole ladder: with the same time constant at every gain, unless the output is at its rail. The mean of its voltage
    /// before and after the step keeps the gain exact.
    double update_input(double input_v, double nominal, double step_s) {
        const double times = ladder(nominal);
        const double before_v = capacitor_v_;
        if (times > 0) {
            const double filled = -std::expm1(-std::min(step_s, kLongestStepS) / filling_s);
            const double wanted_v = input_v + times * (input_v - capacitor_v_);
            capacitor_v_ += (std::clamp(wanted_v, -kRailV, kRailV) - capacitor_v_) / (1 + times) * filled;
        }
        next_v_ = input_v + times * (input_v - (before_v + capacitor_v_) / 2);
        return nominal / (2 * std::numbers::pi * bandwidth_hz);
    }

    double capacitor_v_ = -kHalfSupplyV;  // empty
    double next_v_ = 0;
    double driven_v_ = 0;  // present input of the pole
    double output_v_ = 0;
    std::array<double, 2> inputs_v_{};  // the last two, newest first
    double step_s_ = 0;                 // between them; 0: unknown
};

}  // namespace tricoil::virtual_board
