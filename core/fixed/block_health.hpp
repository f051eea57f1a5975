// What is wrong with a block of samples, from integer sums: signal::inspect_window for parts without a floating-point unit.
#pragma once

#include <span>

#include "core/fixed/acquisition.hpp"
#include "core/signal/column_flags.hpp"

namespace tricoil::fixed {

/// Longest run of samples that the slowest carrier spends within 1 % of its peak, plus one for luck.
int longest_natural_run(const Acquisition& acquisition);

/// Flags of `window`, whichever channel shows them: saturated, clipped, stuck (a sensor channel), dc_offset (a mean beyond a
/// quarter of the range). linear_range: largest code magnitude that is still linear; 0 or less: unknown. Any codes; an empty
/// window has no flags.
ColumnFlags inspect_window(std::span<const Sample> window, int natural_run, std::int32_t linear_range);

}  // namespace tricoil::fixed
