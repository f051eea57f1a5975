#include "board/host/run/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "board/pose_text/flag_names.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

constexpr std::array<const char*, tracking::TrackerCounters{}.rejected.size()> kRejectionNames{
    "not_finite", "bad_sigma", "unknown_state", "time_backwards", "duplicate", "time_ahead"};

const char* multiplexing(const RunReport& report) { return report.plan.is_tdm() ? "tdm" : "fdm"; }

std::uint64_t rejected(const RunReport& report) {
    return std::accumulate(report.tracker.rejected.begin(), report.tracker.rejected.end(), std::uint64_t{0});
}

const char* columns(const RunReport& r) {
    if (!r.plan.is_tdm()) {
        return "simultaneous";
    }
    if (r.tracker_name == "scaat") {
        return "each at its own time";
    }
    return r.deskewed ? "the latest three extrapolated to the newest one's time" : "the latest three taken as simultaneous";
}

nlohmann::ordered_json assumptions(const RunReport& r) {
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

nlohmann::ordered_json acquisition(const RunReport& r) {
    const auto& p = r.plan.params;
    nlohmann::ordered_json carriers = nlohmann::ordered_json::array();
    for (int j = 0; j < r.plan.carriers(); ++j) {
        carriers.push_back(p.carrier_hz[static_cast<std::size_t>(j)]);
    }
    return {{"multiplexing", multiplexing(r)},       {"sample_rate_hz", p.sample_rate_hz},
            {"frame_rate_hz", p.frame_rate_hz},      {"carrier_hz", carriers},
            {"block_samples", r.plan.block_samples}, {"window_samples", r.plan.window_samples}};
}

std::string score_text(const ScoreSummary& s) {
    std::string text = fmt::format(
        "  position     RMS {:.3f} mm   95 % {:.3f} mm   max {:.3f} mm   (bound for simultaneous columns {:.3f} mm)\n",
        1e3 * s.position_m.rms, 1e3 * s.position_m.p95, 1e3 * s.position_m.max, 1e3 * s.bound_position_m);
    text += fmt::format("  orientation  RMS {:.4f} deg  95 % {:.4f} deg  max {:.4f} deg  (bound {:.4f} deg)\n",
                        kDegrees * s.orientation_rad.rms, kDegrees * s.orientation_rad.p95, kDegrees * s.orientation_rad.max,
                        kDegrees * s.bound_orientation_rad);
    text += fmt::format("  predicted    RMS {:.3f} mm, {:.4f} deg (error budget of the poses)\n", 1e3 * s.predicted_position_m,
                        kDegrees * s.predicted_orientation_rad);
    return text;
}

/// Null instead of zero errors if no pose was scored.
nlohmann::ordered_json or_null(const ScoreSummary& s, double value) {
    return s.scored == 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(value);
}

}  // namespace

std::string summary_text(const RunReport& r) {
    const ScoreSummary& s = r.score;
    std::string text = fmt::format("{}: {:.2f} s simulated, {}, {:.0f} frames/s{}\n", r.scenario, r.simulated_s, multiplexing(r),
                                   r.plan.params.frame_rate_hz, r.interrupted ? ", interrupted" : "");
    text += s.scored == 0 ? "  no pose was scored\n" : score_text(s);
    text += fmt::format("  poses        {} scored, {} invalid, {} out of range, {} distorted; mean signal to noise {:.1f} dB\n",
                        s.scored, s.invalid, s.out_of_range, s.distorted, s.snr_db);
    text += fmt::format("  blocks       {} received, {} lost, {} refused; {} columns rejected; {} acquisitions\n", r.loop.blocks,
                        r.loop.lost_blocks, r.loop.refused_blocks, rejected(r), r.tracker.acquisitions);
    text += fmt::format("  speed        {:.1f} us per update, {:.1f} simulated seconds per second; coils {}\n", r.mean_update_us,
                        r.simulated_s_per_s, r.coils_at_end == Excitation::off ? "off" : "ON");
    if (!r.seen_flags.empty()) {
        text += fmt::format("  flags seen   {}\n", to_text(r.seen_flags));
    }
    return text;
}

std::string summary_json(const RunReport& r) {
    const ScoreSummary& s = r.score;
    nlohmann::ordered_json rejections;
    for (std::size_t i = 0; i < kRejectionNames.size(); ++i) {
        rejections[kRejectionNames[i]] = r.tracker.rejected[i];
    }
    const nlohmann::ordered_json json = {
        {"scenario", r.scenario},
        {"tracker", r.tracker_name},
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
        {"reopened", r.tracker.reacquisitions},
        {"clock_restarts", r.tracker.clock_restarts},
        {"flags_seen", to_text(r.seen_flags)},
        {"duration_s", r.simulated_s},
        {"interrupted", r.interrupted},
        {"coils_off", r.coils_at_end == Excitation::off},
        {"update_us", r.mean_update_us},
        {"simulated_s_per_s", r.simulated_s_per_s},
    };
    return json.dump(2) + "\n";
}

}  // namespace tricoil::host
