// Checks of a block of samples before demodulation: saturation, clipping, a stuck converter, an offset.
#pragma once

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column_flags.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Flags of `window`, set if any channel shows the fault: saturated, clipped, stuck (sensor channels only), dc_offset.
/// linear_range: largest code magnitude in the linear range, 0 if unknown. dc_limit: allowed |mean| relative to linear_range.
/// Clipping below linear_range is detected by flat tops: more consecutive samples within 1 % of the peak than the slowest carrier
/// of the plan has there.
ColumnFlags inspect_window(std::span<const Sample> window, const AcquisitionPlan& plan, std::int32_t linear_range,
                           float dc_limit);

}  // namespace tricoil::signal
