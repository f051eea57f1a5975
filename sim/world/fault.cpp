#include "sim/world/fault.hpp"

namespace tricoil::sim {
namespace {

constexpr double kRunawayCurrent = 4;

void swap_columns(Mat3<double>& m, int i, int j) {
    const Vec3<double> before = m.col(i);
    m.col(i) = m.col(j);
    m.col(j) = before;
}

void apply(const Fault& fault, FaultEffect& effect) {
    Mat3<double>& triad = fault.triad == Triad::source ? effect.source : effect.sensor;
    switch (fault.kind) {
        case FaultKind::open_coil:
            effect.current(fault.coils[0]) = 0;
            break;
        case FaultKind::broken_stage:
            effect.current(fault.coils[0]) = kRunawayCurrent;
            break;
        case FaultKind::reversed_coil:
            triad.col(fault.coils[0]) *= -1;
            break;
        case FaultKind::swapped_coils:
            swap_columns(triad, fault.coils[0], fault.coils[1]);
            break;
        case FaultKind::stuck_channel:
            effect.stuck[static_cast<std::size_t>(fault.channel)] = true;
            break;
        case FaultKind::dropped_blocks:
            effect.drop_share = fault.number;
            break;
        case FaultKind::metal:
            break;
        case FaultKind::unplugged:
            effect.unplugged = true;
            break;
        case FaultKind::overload:
            effect.overload_ranges += fault.number;
            break;
    }
}

}  // namespace

FaultEffect effect_at(const std::vector<Fault>& faults, double time_s) {
    FaultEffect effect;
    for (const Fault& fault : faults) {
        if (time_s >= fault.begin_s && time_s < fault.end_s) {
            apply(fault, effect);
        }
    }
    return effect;
}

}  // namespace tricoil::sim
