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
    flags.set_if(columns.has(ColumnFlag::overrun), PoseFlag::unconfirmed);  // samples are missing: the phase is unknown
    return flags;
}

}  // namespace tricoil::tracking
