// One source coil with its power stage, driven sample by sample.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace tricoil::virtual_board {

/// A low-pass behind the DAC; a stage that acts as a voltage source with resistance; the coil. Solved exactly between changes of
/// the drive. If the stage is off, its output is open and the clamp diodes connect the coil to the supply until the current is
/// zero.
class DrivenCoil {
public:
    struct Params {
        double smoothing_s = 1;
        double amperes_per_volt = 0;  // of direct current, from the DAC's output
        double resistance_ohm = 1;    // of coil and stage
        double inductance_h = 1;
        double supply_v = 1;
        double limit_a = 1;  // of the stage
    };

    explicit DrivenCoil(const Params& params) : params_(params), coil_s_(params.inductance_h / params.resistance_ohm) {
        constexpr double kNearlyEqual = 1e-4;  // equal time constants have no solution of this form
        if (std::abs(coil_s_ / params_.smoothing_s - 1) < kNearlyEqual) {
            coil_s_ = params_.smoothing_s * (1 + kNearlyEqual);
        }
    }

    /// Advances by `step_s` with the DAC at `drive_v`.
    void advance(double drive_v, bool on, double step_s) {
        const Decay& d = decay(step_s);
        const double before_v = stage_v_;
        stage_v_ = drive_v + (stage_v_ - drive_v) * d.stage;
        if (!on) {
            discharge(step_s);
            return;
        }
        // v' = (u - v)/T1, i' = (g v - i)/T2: the new steady state plus one exponential per time constant.
        const double gain = params_.amperes_per_volt;
        const double settled = drive_v * gain;
        const double from_stage = (before_v - drive_v) * gain / (1 - coil_s_ / params_.smoothing_s);
        const double own = current_ - settled - from_stage;
        current_ = std::clamp(settled + from_stage * d.stage + own * d.coil, -params_.limit_a, params_.limit_a);
        derivative_ = (stage_v_ * gain - current_) / coil_s_;
    }
    /// Current, A.
    [[nodiscard]] double current() const { return current_; }
    /// Rate of change of the current, A/s.
    [[nodiscard]] double derivative() const { return derivative_; }

private:
    struct Decay {
        double step_s = -1;
        double stage = 0;
        double coil = 0;
    };
    const Decay& decay(double step_s) {
        for (const Decay& d : decays_) {
            if (d.step_s == step_s) {
                return d;
            }
        }
        Decay& d = decays_[next_decay_++ % decays_.size()];
        d = {step_s, std::exp(-step_s / params_.smoothing_s), std::exp(-step_s / coil_s_)};
        return d;
    }
    void discharge(double step_s) {
        const double rate = params_.supply_v / params_.inductance_h;
        const double left = std::max(std::abs(current_) - rate * step_s, 0.0);
        derivative_ = left > 0 ? -std::copysign(rate, current_) : 0;
        current_ = std::copysign(left, current_);
    }

    Params params_;
    double coil_s_;  // L/R
    double stage_v_ = 0;
    double current_ = 0;
    double derivative_ = 0;
    std::array<Decay, 4> decays_;  // of the step lengths in use
    unsigned next_decay_ = 0;
};

}  // namespace tricoil::virtual_board
