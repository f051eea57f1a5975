// What is wrong with a block of samples before any arithmetic on it: saturation, clipping, a stuck converter, an offset.
#pragma once

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column_flags.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Flags of `window`, whichever channel shows them: saturated, clipped, stuck (a sensor channel), dc_offset.
/// linear_range: largest code magnitude that is still linear, 0 if unknown. dc_limit: allowed |mean| as a share of it.
/// Clipping below that shows as flat tops: more samples in a row within 1 % of the peak than the plan's slowest carrier spends
/// there.
ColumnFlags inspect_window(std::span<const Sample> window, const AcquisitionPlan& plan, std::int32_t linear_range,
                           float dc_limit);

}  // namespace tricoil::signal
