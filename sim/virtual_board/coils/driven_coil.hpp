// One source coil behind its power stage, driven sample by sample.
#pragma once

#include <array>

namespace tricoil::virtual_board {

/// A power stage that smooths what it is given (one pole), and a coil in series with its resistance; solved exactly between
/// changes of drive. Currents in volts of the reference channel.
class DrivenCoil {
public:
    struct Params {
        double smoothing_s = 1.6e-6;  // 100 kHz
        double resistance_ohm = 10;
        double inductance_h = 300e-6;
        double volts_per_ohm = 1;  // reference volts of one ampere
    };

    explicit DrivenCoil(const Params& params);

    /// Lets `step_s` pass with the stage's input at `drive_v`.
    void advance(double drive_v, double step_s);
    [[nodiscard]] double current() const { return current_; }
    /// Its rate of change, 1/s.
    [[nodiscard]] double derivative() const;
    void rest() { stage_v_ = current_ = 0; }

private:
    struct Decay {
        double step_s = -1;
        double stage = 0;
        double coil = 0;
    };
    const Decay& decay(double step_s);

    Params params_;
    double coil_s_;  // L/R
    double stage_v_ = 0;
    double current_ = 0;
    std::array<Decay, 4> decays_;  // of the few steps that there are
    unsigned next_decay_ = 0;
};

}  // namespace tricoil::virtual_board
