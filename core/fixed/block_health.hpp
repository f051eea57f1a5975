// Checks of a block of samples with integer sums. Twin of signal::inspect_window.
#pragma once

#include <span>

#include "core/fixed/acquisition.hpp"
#include "core/signal/column_flags.hpp"

namespace tricoil::fixed {

/// Longest run of samples that the slowest carrier spends within 1 % of its peak, plus one as a margin.
int longest_natural_run(const Acquisition& acquisition);

/// Flags of `window`, set if any channel shows the fault: saturated, clipped, stuck (sensor channels only), dc_offset (a mean
/// beyond a quarter of the range). linear_range: largest code magnitude in the linear range; 0 or less: unknown. Any codes are
/// allowed. An empty window has no flags.
ColumnFlags inspect_window(std::span<const Sample> window, int natural_run, std::int32_t linear_range);

}  // namespace tricoil::fixed
