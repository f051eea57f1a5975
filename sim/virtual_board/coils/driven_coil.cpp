#include "sim/virtual_board/coils/driven_coil.hpp"

#include <cmath>

namespace tricoil::virtual_board {

DrivenCoil::DrivenCoil(const Params& params) : params_(params), coil_s_(params.inductance_h / params.resistance_ohm) {}

const DrivenCoil::Decay& DrivenCoil::decay(double step_s) {
    for (const Decay& d : decays_) {
        if (d.step_s == step_s) {
            return d;
        }
    }
    Decay& d = decays_[next_decay_++ % decays_.size()];
    d = {step_s, std::exp(-step_s / params_.smoothing_s), std::exp(-step_s / coil_s_)};
    return d;
}

void DrivenCoil::advance(double drive_v, double step_s) {
    const Decay& d = decay(step_s);
    // v' = (u - v)/T1, i' = (v/R - i)/T2: the new steady state plus one exponential per time constant.
    const double settled = drive_v * params_.volts_per_ohm / params_.resistance_ohm;
    const double from_stage =
        (stage_v_ - drive_v) * params_.volts_per_ohm / params_.resistance_ohm / (1 - coil_s_ / params_.smoothing_s);
    const double own = current_ - settled - from_stage;
    current_ = settled + from_stage * d.stage + own * d.coil;
    stage_v_ = drive_v + (stage_v_ - drive_v) * d.stage;
}

double DrivenCoil::derivative() const { return (stage_v_ * params_.volts_per_ohm / params_.resistance_ohm - current_) / coil_s_; }

}  // namespace tricoil::virtual_board
