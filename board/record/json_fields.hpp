// Parameters of a tracker as named fields, each listed once for writing and reading. A parameter that is added to the core stops
// the build here until a recording holds it too: without it a replay would be another run.
#pragma once

#include "core/calibration/calibration.hpp"
#include "core/tracking/scaat/params.hpp"
#include "core/tracking/tracker.hpp"

namespace tricoil::host {

template <typename Params, typename Visit>
void visit_tracker(Params& params, Visit&& visit) {
    auto& [method, passes, coupling_constant, hemisphere, confined, max_column_span, deskew, window_s, latency_s, min_snr,
           max_misfit, distortion_gate, lost_after, search_after] = params;
    visit("method", method);
    visit("passes", passes);
    visit("coupling_constant_m3", coupling_constant);
    visit("hemisphere", hemisphere);
    visit("confined", confined);
    visit("max_column_span_us", max_column_span);
    visit("deskew", deskew);
    visit("window_s", window_s);
    visit("latency_s", latency_s);
    visit("min_snr", min_snr);
    visit("max_misfit", max_misfit);
    visit("distortion_gate", distortion_gate);
    visit("lost_after_us", lost_after);
    visit("search_after_us", search_after);
}

template <typename Params, typename Visit>
void visit_process_noise(Params& params, Visit&& visit) {
    auto& [least_m2_s3, most_m2_s3, start_m2_s3, least_rad2_s3, most_rad2_s3, start_rad2_s3, gain, rise, smoothing,
           information_floor, largest_step] = params;
    visit("least_m2_s3", least_m2_s3);
    visit("most_m2_s3", most_m2_s3);
    visit("start_m2_s3", start_m2_s3);
    visit("least_rad2_s3", least_rad2_s3);
    visit("most_rad2_s3", most_rad2_s3);
    visit("start_rad2_s3", start_rad2_s3);
    visit("gain", gain);
    visit("rise", rise);
    visit("smoothing", smoothing);
    visit("information_floor", information_floor);
    visit("largest_step", largest_step);
}

template <typename Params, typename Visit>
void visit_filter(Params& params, Visit&& visit) {
    auto& [hemisphere, confined, max_column_span, window_s, latency_s, process, gate, most_opened, start_speed_m_s,
           start_rate_rad_s, consistency_gain, inconsistent_above, min_snr, max_misfit, distortion_gate, max_lateness,
           coast_limit, lost_after, search_after, predict_ahead] = params;
    visit("hemisphere", hemisphere);
    visit("confined", confined);
    visit("max_column_span_us", max_column_span);
    visit("window_s", window_s);
    visit("latency_s", latency_s);
    visit_process_noise(process, visit);
    visit("gate", gate);
    visit("most_opened", most_opened);
    visit("start_speed_m_s", start_speed_m_s);
    visit("start_rate_rad_s", start_rate_rad_s);
    visit("consistency_gain", consistency_gain);
    visit("inconsistent_above", inconsistent_above);
    visit("min_snr", min_snr);
    visit("max_misfit", max_misfit);
    visit("distortion_gate", distortion_gate);
    visit("max_lateness_us", max_lateness);
    visit("coast_limit_us", coast_limit);
    visit("lost_after_us", lost_after);
    visit("search_after_us", search_after);
    visit("predict_ahead_us", predict_ahead);
}

template <typename Calibration, typename Visit>
void visit_calibration(Calibration& known, Visit&& visit) {
    auto& [model, phase_rad, hemisphere, output_linear, output_offset_m] = known;
    auto& [source_offset_m, source_moment, sensor_offset_m, sensor_sensitivity, source_octupole_m2, sensor_octupole_m2] = model;
    visit("source_offset_m", source_offset_m);
    visit("source_moment", source_moment);
    visit("sensor_offset_m", sensor_offset_m);
    visit("sensor_sensitivity", sensor_sensitivity);
    visit("source_octupole_m2", source_octupole_m2);
    visit("sensor_octupole_m2", sensor_octupole_m2);
    visit("phase_rad", phase_rad);
    visit("hemisphere", hemisphere);
    visit("output_linear", output_linear);
    visit("output_offset_m", output_offset_m);
}

}  // namespace tricoil::host
