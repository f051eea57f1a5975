// What is wrong with a block of samples before any arithmetic on it: saturation, clipping, a stuck converter, an offset.
#pragma once

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Flags of `window`, whichever channel shows them: saturated, clipped, stuck (a sensor channel), dc_offset.
/// full_scale: largest code magnitude, 0 if unknown. dc_limit: allowed |mean| as a share of full scale.
/// Clipping below full scale is told by flat tops: more samples in a row within 1 % of the peak than the plan's fastest carrier
/// allows.
ColumnFlags inspect_window(std::span<const Sample> window, const AcquisitionPlan& plan, std::int32_t full_scale, float dc_limit);

}  // namespace tricoil::signal
