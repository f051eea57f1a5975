// Tracker parameters as named fields, each listed once for writing and reading. A parameter that is added to the core does not
// compile here until it is listed: a replay needs all parameters.
#pragma once

#include <concepts>
#include <type_traits>

#include "core/calibration/calibration.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

template <typename Params, typename Visit>
void visit_common(Params& params, Visit&& visit) {
    auto& [coupling_constant, hemisphere, confined, floor_share, max_column_span, window_s, latency_s, min_snr, max_misfit,
           distortion_gate, misfit_floor, quadrature_floor, quadrature_lag_s, max_deviation_m, pick_up_sigma, lost_after,
           search_after, converter] = params;
    visit("coupling_constant_m3", coupling_constant);
    visit("hemisphere", hemisphere);
    visit("confined", confined);
    visit("max_column_span_us", max_column_span);
    visit("window_s", window_s);
    visit("latency_s", latency_s);
    visit("min_snr", min_snr);
    visit("max_misfit", max_misfit);
    visit("distortion_gate", distortion_gate);
    visit("misfit_floor", misfit_floor);
    visit("quadrature_floor", quadrature_floor);
    visit("quadrature_lag_s", quadrature_lag_s);
    visit("max_deviation_m", max_deviation_m);
    visit("lost_after_us", lost_after);
    visit("search_after_us", search_after);
    visit("pick_up_sigma", pick_up_sigma);
    visit("floor_share", floor_share);
    visit("converter_step", converter.coupling);
    visit("converter_noise", converter.noise);
}

/// Parameters of this method, constant or not.
template <typename Params, typename Method>
concept ParamsOf = std::same_as<std::remove_const_t<Params>, Method>;

template <ParamsOf<tracking::DirectParams> Params, typename Visit>
void visit_method(Params& params, Visit&& visit) {
    auto& [deskew] = params;
    visit("deskew", deskew);
}

template <ParamsOf<tracking::PreviousParams> Params, typename Visit>
void visit_method(Params& params, Visit&& visit) {
    auto& [passes, deskew] = params;
    visit("passes", passes);
    visit("deskew", deskew);
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

template <ParamsOf<tracking::ScaatParams<double>> Params, typename Visit>
void visit_method(Params& params, Visit&& visit) {
    auto& [process, gate, most_inflated, start_speed_m_s, start_rate_rad_s, consistency_gain, inconsistent_above, max_lateness,
           coast_limit, predict_ahead] = params;
    visit_process_noise(process, visit);
    visit("gate", gate);
    visit("most_inflated", most_inflated);
    visit("start_speed_m_s", start_speed_m_s);
    visit("start_rate_rad_s", start_rate_rad_s);
    visit("consistency_gain", consistency_gain);
    visit("inconsistent_above", inconsistent_above);
    visit("max_lateness_us", max_lateness);
    visit("coast_limit_us", coast_limit);
    visit("predict_ahead_us", predict_ahead);
}

template <ParamsOf<tracking::DualBandParams> Params, typename Visit>
void visit_method(Params& params, Visit&& visit) {
    auto& [frame_s, window_frames, filter, predict_ahead] = params;
    visit("frame_s", frame_s);
    visit("window_frames", window_frames);
    visit("filter", filter);
    visit("filter_predict_ahead_us", predict_ahead);
}

/// Fields of the method that `params` holds. The method's name is not a field.
template <typename Params, typename Visit>
void visit_tracker(Params& params, Visit&& visit) {
    visit_common(params.common, visit);
    std::visit([&](auto& method) { visit_method(method, visit); }, params.method);
}

template <typename Calibration, typename Visit>
void visit_calibration(Calibration& known, Visit&& visit) {
    auto& [model, phase_rad, hemisphere, output_linear, output_offset_m, misfit_floor, quadrature_floor, converters, pick_up,
           errors, low_band, surroundings_lag] = known;
    static_cast<void>(converters);  // not a parameter of trackers: the columns are corrected before the trackers
    auto& [source_offset_m, source_moment, sensor_offset_m, sensor_sensitivity, source_octupole_m2, sensor_octupole_m2,
           surroundings] = model;
    visit("source_offset_m", source_offset_m);
    visit("source_moment", source_moment);
    visit("sensor_offset_m", sensor_offset_m);
    visit("sensor_sensitivity", sensor_sensitivity);
    visit("source_octupole_m2", source_octupole_m2);
    visit("sensor_octupole_m2", sensor_octupole_m2);
    visit("surroundings", surroundings);
    visit("phase_rad", phase_rad);
    visit("hemisphere", hemisphere);
    visit("output_linear", output_linear);
    visit("output_offset_m", output_offset_m);
    visit("calibrated_misfit_floor", misfit_floor);
    visit("calibrated_quadrature_floor", quadrature_floor);
    visit("low_band_ratio", low_band.ratio);
    visit("low_band_phase_rad", low_band.phase_rad);
    visit("low_band_quadrature_floor", low_band.quadrature_floor);
    visit("motion_lag_s", low_band.motion_lag_s);
    visit("pick_up", pick_up.in_phase);
    visit("pick_up_quadrature", pick_up.quadrature);
    visit("calibrated_pick_up_sigma", pick_up.sigma);
    visit("coupling_constant_error", errors.coupling_constant);
    visit("couplings_error", errors.couplings);
    visit("calibrated_floor_share", errors.floor_share);
    visit("low_band_pick_up", low_band.pick_up.in_phase);
    visit("low_band_pick_up_quadrature", low_band.pick_up.quadrature);
    visit("low_band_pick_up_sigma", low_band.pick_up.sigma);
    visit("surroundings_quadrature", surroundings_lag.dipoles);
    visit("surroundings_deviation", surroundings_lag.deviation);
}

}  // namespace tricoil::host
