// One of the chip's op-amps in front of a sensor channel's converter, as it came from the factory.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace tricoil::virtual_board {

/// Gains of a ladder that are somewhat off, one pole that comes down as the gain goes up, rails, and the capacitor that the
/// ladder ends at. Voltages are around half the supply.
class SensorAmplifier {
public:
    /// Gains 2, 4, ... 64.
    static constexpr std::size_t kLadderSteps = 6;

    SensorAmplifier() = default;
    /// Ladder within 2 %, bandwidth within a quarter of 13 MHz (DS12288: typical).
    explicit SensorAmplifier(std::mt19937_64& random) {
        std::uniform_real_distribution<double> unit(-1, 1);
        for (double& error : ladder_error) {
            error = 0.02 * unit(random);
        }
        bandwidth_hz *= 1 + 0.25 * unit(random);
    }

    /// What its gain is instead of 1, 2, 4, ... 64.
    [[nodiscard]] double gain(double nominal) const {
        return nominal < 2 ? 1 : nominal * (1 + ladder_error[static_cast<std::size_t>(std::lround(std::log2(nominal))) - 1]);
    }

    /// An input that went in a straight line since the last sample.
    void follow(double input_v, double nominal, double step_s) {
        const double lag_s = take(input_v, nominal, step_s);
        const double slope = (next_v_ - driven_v_) / step_s;
        output_v_ = next_v_ - lag_s * slope + (output_v_ - driven_v_ + lag_s * slope) * std::exp(-step_s / lag_s);
        driven_v_ = next_v_;
    }

    /// An input that jumped `held_s` ago.
    void jump(double input_v, double nominal, double step_s, double held_s) {
        const double lag_s = take(input_v, nominal, step_s);
        output_v_ = driven_v_ + (output_v_ - driven_v_) * std::exp(-std::max(step_s - held_s, 0.0) / lag_s);
        output_v_ = next_v_ + (output_v_ - next_v_) * std::exp(-held_s / lag_s);
        driven_v_ = next_v_;
    }

    /// Of its own, at the converter: white at the input, as far as the pole lets it through; what lies beyond half the rate of
    /// conversions folds back. Volts.
    [[nodiscard]] double noise_v(double nominal) const {
        return kNoiseV_rthz * nominal * std::sqrt(std::numbers::pi / 2 * bandwidth_hz / nominal);
    }

    [[nodiscard]] double output_v() const { return std::clamp(output_v_, -kRailV, kRailV); }
    void lose_power() {
        capacitor_v_ = -kHalfSupplyV;  // empty
        next_v_ = driven_v_ = output_v_ = 0;
    }

    std::array<double, kLadderSteps> ladder_error{};
    double bandwidth_hz = 13e6;
    bool has_capacitor = true;

private:
    static constexpr double kHalfSupplyV = 1.65;
    static constexpr double kNoiseV_rthz = 100e-9;  // as HARDWARE.md supposes
    static constexpr double kRailV = kHalfSupplyV - 0.05;
    static constexpr double kFillingS = 10e-3;  // 10 kOhm of the ladder, 1 uF
    static constexpr double kLongestStepS =
        5e-6;  // while nothing samples it is not known since when there is a ladder: as if not

    /// Returns the lag. The ladder amplifies what the input is away from the capacitor, which the output fills slowly through all
    /// of the ladder: with one time constant at every gain, unless the output is at its rail.
    double take(double input_v, double nominal, double step_s) {
        const double ladder = has_capacitor ? gain(nominal) - 1 : 0;
        if (ladder > 0) {
            const double filled = -std::expm1(-std::min(step_s, kLongestStepS) / kFillingS);
            const double wanted_v = input_v + ladder * (input_v - capacitor_v_);
            capacitor_v_ += (std::clamp(wanted_v, -kRailV, kRailV) - capacitor_v_) / (1 + ladder) * filled;
        }
        next_v_ = input_v + ladder * (input_v - capacitor_v_);
        return nominal / (2 * std::numbers::pi * bandwidth_hz);
    }

    double capacitor_v_ = -kHalfSupplyV;  // empty
    double next_v_ = 0;
    double driven_v_ = 0;  // what the pole was driven with up to now
    double output_v_ = 0;
};

}  // namespace tricoil::virtual_board
