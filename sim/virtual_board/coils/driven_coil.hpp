// One source coil with its power stage, driven sample by sample.
#pragma once

#include <array>

namespace tricoil::virtual_board {

/// A power stage with a one-pole low-pass, and a coil in series with its resistance; solved exactly between changes of the drive.
/// Currents in volts of the reference channel.
class DrivenCoil {
public:
    struct Params {
        double smoothing_s = 1.6e-6;  // 100 kHz
        double resistance_ohm = 10;
        double inductance_h = 300e-6;
        double volts_per_ohm = 1;  // reference volts per ampere
    };

    explicit DrivenCoil(const Params& params);

    /// Advances by `step_s` with the input of the stage at `drive_v`.
    void advance(double drive_v, double step_s);
    [[nodiscard]] double current() const { return current_; }
    /// Rate of change of the current, in volts of the reference channel per second.
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
    std::array<Decay, 4> decays_;  // of the step lengths in use
    unsigned next_decay_ = 0;
};

}  // namespace tricoil::virtual_board
