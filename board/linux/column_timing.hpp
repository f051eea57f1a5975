// Settings of trackers that follow from the configuration and the timing of the columns.
#pragma once

#include "board/linux/device_loop.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

/// For sequential (tdm) or simultaneous columns. If the firmware has no plan with this frame rate, the quadrature is not judged.
tracking::TrackerTap<double>::Settings tracker_settings(const DeviceLoopParams& params, int sensors,
                                                        signal::Multiplexing multiplexing, double frame_rate_hz);

}  // namespace tricoil::linux_board
