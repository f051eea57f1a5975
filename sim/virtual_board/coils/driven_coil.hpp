// One source coil with its power stage, driven sample by sample.
#pragma once

#include <array>

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

    explicit DrivenCoil(const Params& params);

    /// Advances by `step_s` with the DAC at `drive_v`.
    void advance(double drive_v, bool on, double step_s);
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
    const Decay& decay(double step_s);
    void discharge(double step_s);

    Params params_;
    double coil_s_;  // L/R
    double stage_v_ = 0;
    double current_ = 0;
    double derivative_ = 0;
    std::array<Decay, 4> decays_;  // of the step lengths in use
    unsigned next_decay_ = 0;
};

}  // namespace tricoil::virtual_board
