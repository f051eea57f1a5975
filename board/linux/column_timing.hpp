// Settings of trackers that follow from the configuration and the timing of the columns.
#pragma once

#include "board/linux/device_loop.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

/// For sequential (tdm) or simultaneous columns. If the firmware has no plan with this frame rate, the quadrature is not judged.
inline tracking::TrackerTap<double>::Settings tracker_settings(const DeviceLoopParams& params, int sensors,
                                                               signal::Multiplexing multiplexing, double frame_rate_hz) {
    tracking::TrackerTap<double>::Settings settings;
    settings.sensors = sensors;
    settings.calibration = params.calibration;
    settings.tracker.method = params.method;
    tracking::CommonParams<double>& common = settings.tracker.common;
    common.coupling_constant = params.coupling_constant_m3;
    common.hemisphere = params.hemisphere;
    common.confined = params.session.confined;
    const bool is_tdm = multiplexing == signal::Multiplexing::tdm;
    const auto plan = signal::plan_acquisition(signal::default_acquisition(multiplexing, frame_rate_hz));
    if (plan.ok()) {
        tracking::set_plan(common, *plan);
    } else {
        common.max_column_span = microseconds_from_seconds(is_tdm ? 0.8 / frame_rate_hz : 0);
        if (settings.calibration) {
            settings.calibration->quadrature_floor = 1;
            settings.calibration->surroundings_lag = {};
        }
    }
    if (auto* bands = std::get_if<tracking::DualBandParams>(&settings.tracker.method)) {
        tracking::set_frame(*bands, 1 / frame_rate_hz);
    }
    host::set_deskew(settings.tracker.method, is_tdm);
    return settings;
}

}  // namespace tricoil::linux_board
