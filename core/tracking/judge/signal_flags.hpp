// Pose flags that follow from column flags, common to all trackers.
#pragma once

#include "core/signal/column.hpp"
#include "core/tracking/pose_flags.hpp"

namespace tricoil::tracking {

constexpr PoseFlags signal_flags(ColumnFlags columns) {
    PoseFlags flags;
    flags.set_if(columns.has_any({ColumnFlag::saturated, ColumnFlag::clipped, ColumnFlag::dc_offset}), PoseFlag::saturated);
    flags.set_if(columns.has(ColumnFlag::no_reference), PoseFlag::no_reference);
    flags.set_if(columns.has(ColumnFlag::low_signal), PoseFlag::low_signal);
    flags.set_if(columns.has(ColumnFlag::stuck), PoseFlag::no_sensor);
    // Samples are missing, or the amplifier settles: amplitude and phase are unknown.
    flags.set_if(columns.has_any({ColumnFlag::overrun, ColumnFlag::gain_changed}), PoseFlag::unconfirmed);
    return flags;
}

}  // namespace tricoil::tracking
