// Checks of a block of samples before demodulation: saturation, clipping, a stuck converter, an offset.
#pragma once

#include <span>

#include "core/signal/column_flags.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Longest run of samples that a cosine of the slowest high carrier spends within 1 % of its peak, plus one for rounding of the
/// start. Low carriers are slower, but at a peak of the sum the high ones dominate the curvature. `cycles`: of each high carrier
/// in the window.
int longest_natural_run(std::span<const int> cycles, int window_samples);

/// Flags of `window`, set if any channel shows the fault: saturated, clipped, stuck (sensor channels only), dc_offset (a mean
/// beyond 1 / offset_divisor of the range). linear_range: largest code magnitude in the linear range; 0 or less: unknown.
/// Clipping below it is detected by flat tops: more consecutive samples within 1 % of the peak than `natural_run`. Any codes are
/// allowed. An empty window has no flags.
ColumnFlags inspect_window(std::span<const Sample> window, int natural_run, std::int32_t linear_range, int offset_divisor = 4);

}  // namespace tricoil::signal
