#include "board/host/run/report.hpp"

#include "board/pose_text/flag_names.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

constexpr std::array<const char*, tracking::TrackerCounters{}.rejected.size()> kRejectionNames{
    "not_finite", "bad_sigma", "unknown_state", "time_backwards", "duplicate", "time_ahead"};

constexpr const char* kScoreText =
    "  position     RMS {position_rms_m in mm:.3f} mm   95 % {position_p95_m in mm:.3f} mm   max {position_max_m in mm:.3f} mm   "
    "(bound for simultaneous columns {bound_position_rms_m in mm:.3f} mm)\n"
    "  orientation  RMS {orientation_rms_deg:.4f} deg  95 % {orientation_p95_deg:.4f} deg  max {orientation_max_deg:.4f} deg  "
    "(bound {bound_orientation_rms_deg:.4f} deg)\n"
    "  expected     RMS {expected_position_rms_m in mm:.3f} mm, {expected_orientation_rms_deg:.4f} deg "
    "(stated deviations of the poses: noise, motion and metal)\n";

const std::string& multiplexing(const RunReport& report) {
    return kMultiplexingNames[static_cast<std::size_t>(report.plan.params.multiplexing)];
}

const char* columns(const RunReport& r) {
    if (!r.plan.is_tdm()) {
        return "simultaneous";
    }
    if (r.tracker_name.starts_with("scaat")) {
        return "each at its own time";
    }
    return r.deskewed ? "the latest three extrapolated to the time of the newest" : "the latest three taken as simultaneous";
}

Json assumptions(const RunReport& r) {
    const auto& world = r.world;
    return {{"noise_v_per_sqrt_hz", world.converter.noise_v_per_sqrt_hz},
            {"mains_v", world.mains_v},
            {"converter_bits", world.converter.bits},
            {"converter_range_v", world.converter.range_v},
            {"coupling_constant_m3", world.coupling_constant_m3},
            {"coupling_sigma", r.coupling_sigma},
            {"channel_phase_and_gain", "known exactly"},
            {"columns", columns(r)}};
}

Json acquisition(const RunReport& r) {
    const auto& p = r.plan.params;
    Json carriers = Json::array();
    for (int j = 0; j < r.plan.carriers(); ++j) {
        carriers.push_back(p.carrier_hz[static_cast<std::size_t>(j)]);
    }
    return {{"multiplexing", multiplexing(r)},       {"sample_rate_hz", p.sample_rate_hz},
            {"frame_rate_hz", p.frame_rate_hz},      {"carrier_hz", carriers},
            {"block_samples", r.plan.block_samples}, {"window_samples", r.plan.window_samples}};
}

/// Null instead of zero errors if no pose was scored.
Json or_null(const ScoreSummary& s, double value) { return s.scored == 0 ? Json(nullptr) : Json(value); }

}  // namespace

Json run_result(const RunReport& r) {
    const ScoreSummary& s = r.score;
    Json rejections;
    for (std::size_t i = 0; i < kRejectionNames.size(); ++i) {
        rejections[kRejectionNames[i]] = r.tracker.rejected[i];
    }
    return {
        {"scenario", r.scenario},
        {"tracker", r.tracker_name},
        {"fidelity", r.fidelity},
        {"position_rms_m", or_null(s, s.position_m.rms)},
        {"position_p95_m", or_null(s, s.position_m.p95)},
        {"position_max_m", or_null(s, s.position_m.max)},
        {"orientation_rms_deg", or_null(s, kDegrees * s.orientation_rad.rms)},
        {"orientation_p95_deg", or_null(s, kDegrees * s.orientation_rad.p95)},
        {"orientation_max_deg", or_null(s, kDegrees * s.orientation_rad.max)},
        {"bound_position_rms_m", or_null(s, s.bound_position_m)},
        {"bound_orientation_rms_deg", or_null(s, kDegrees * s.bound_orientation_rad)},
        {"blur_position_rms_m", or_null(s, s.blur_position_m)},
        {"predicted_position_rms_m", or_null(s, s.predicted_position_m)},
        {"predicted_orientation_rms_deg", or_null(s, kDegrees * s.predicted_orientation_rad)},
        {"expected_position_rms_m", or_null(s, s.expected_position_m)},
        {"expected_orientation_rms_deg", or_null(s, kDegrees * s.expected_orientation_rad)},
        {"smoothed_position_rms_m", r.smoothed ? or_null(*r.smoothed, r.smoothed->position_m.rms) : Json(nullptr)},
        {"smoothed_orientation_rms_deg",
         r.smoothed ? or_null(*r.smoothed, kDegrees * r.smoothed->orientation_rad.rms) : Json(nullptr)},
        {"mean_snr_db", or_null(s, s.snr_db)},
        {"poses_scored", s.scored},
        {"poses_invalid", s.invalid},
        {"poses_out_of_range", s.out_of_range},
        {"poses_distorted", s.distorted},
        {"acquisition", acquisition(r)},
        {"assumed", assumptions(r)},
        {"blocks", r.loop.blocks},
        {"blocks_lost", r.loop.lost_blocks},
        {"blocks_refused", r.loop.refused_blocks},
        {"columns_rejected", rejections},
        {"acquisitions", r.tracker.acquisitions},
        {"outliers", r.tracker.outliers},
        {"reacquisitions", r.tracker.reacquisitions},
        {"clock_restarts", r.tracker.clock_restarts},
        {"health", health_json(r.health)},
        {"flags_seen", to_text(r.seen_flags)},
        {"advice", advice(r.last_flags)},
        {"duration_s", r.simulated_s},
        {"interrupted", r.interrupted},
        {"coils_off", r.coils_at_end == Excitation::off},
        {"update_us", r.mean_update_us},
        {"simulated_s_per_s", r.simulated_s_per_s},
    };
}

std::string run_text(const Json& r) {
    std::string text =
        fill(r, "{scenario}: {duration_s:.2f} s simulated, {acquisition/multiplexing}, {acquisition/frame_rate_hz:.0f} frames/s");
    text += r["interrupted"] ? ", interrupted\n" : "\n";
    const bool scored = r["poses_scored"] > 0;
    text += scored ? fill(r, kScoreText) : "  no pose was scored\n";
    if (!r["smoothed_position_rms_m"].is_null()) {
        text += fill(r,
                     "  smoothed     RMS {smoothed_position_rms_m in mm:.3f} mm, {smoothed_orientation_rms_deg:.4f} deg (each "
                     "pose from the "
                     "columns before and after it)\n");
    }
    text += fill(r,
                 "  poses        {poses_scored} scored, {poses_invalid} invalid, {poses_out_of_range} out of range, "
                 "{poses_distorted} distorted; mean signal to noise ");
    text += scored ? fill(r, "{mean_snr_db:.1f} dB\n") : "0.0 dB\n";
    text += fill(
        r,
        "  blocks       {blocks} received, {blocks_lost} lost, {blocks_refused} refused; {columns_rejected} columns rejected; "
        "{acquisitions} acquisitions\n"
        "  speed        {update_us:.1f} us per update, {simulated_s_per_s:.1f} simulated seconds per second; coils ");
    text += r["coils_off"] ? "off\n" : "ON\n";
    const auto count = [&](const char* key) { return r[key].get<std::uint64_t>(); };
    const auto all = count("poses_scored") + count("poses_invalid");
    const std::string invalid = pose_warning(count("poses_invalid"), all, "invalid");
    const std::string distorted = pose_warning(count("poses_distorted"), count("poses_scored"), "distorted");
    text += "  health       " +
            health_line(r["health"], invalid + (invalid.empty() || distorted.empty() ? "" : "; ") + distorted) + '\n';
    if (r["flags_seen"] != "") {
        text += fill(r, r["advice"] == "" ? "  flags seen   {flags_seen}\n" : "  flags seen   {flags_seen}; {advice}\n");
    }
    return text;
}

}  // namespace tricoil::host
