// Defects of the samples of a column, and its band.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"

namespace tricoil {

/// Flags of a column (bit numbers).
enum class ColumnFlag : std::uint8_t {
    saturated,         // a code beyond the linear range
    clipped,           // flat tops within the linear range: an amplifier at its limit
    stuck,             // a channel with constant code
    no_reference,      // no reference current: the coupling has no scale and no sign
    dc_offset,         // mean beyond the allowed share of the linear range
    low_signal,        // norm of the column below the detection limit
    overrun,           // the converter lost samples within the block
    gain_changed = 8,  // FDM: the gain step changed at the start of the block; 7 is a flag of the wire only
    after_gap,         // columns between the sensor's previous column and this one were lost or refused
    low_band,          // not a defect: measured at the coil's low carrier, for trackers that use two bands
};
using ColumnFlags = FlagSet<ColumnFlag>;

constexpr ColumnFlags kAllColumnFlags{
    ColumnFlag::saturated,  ColumnFlag::clipped, ColumnFlag::stuck,        ColumnFlag::no_reference, ColumnFlag::dc_offset,
    ColumnFlag::low_signal, ColumnFlag::overrun, ColumnFlag::gain_changed, ColumnFlag::after_gap,    ColumnFlag::low_band};

}  // namespace tricoil
