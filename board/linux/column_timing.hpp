// Parameters of trackers that follow from the timing of the columns.
#pragma once

#include "core/signal/acquisition_plan.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

/// Sets them for sequential (tdm) or simultaneous columns. If the firmware has no plan with this frame rate, the quadrature is
/// not judged.
void set_timing(signal::Multiplexing multiplexing, double frame_rate_hz, tracking::TrackerTap<double>::Settings& settings);

}  // namespace tricoil::linux_board
