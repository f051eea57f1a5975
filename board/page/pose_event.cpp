#include "board/page/pose_event.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "board/pose_text/flag_names.hpp"
#include "board/support/json_text.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host::web {
namespace {

using tracking::TrackerState;

Json json_of(const PageStatus& status) {
    const TourPlace& tour = status.tour;
    Json confined_to = Json::array();
    for (const Vec3<double>& towards : status.confinement) {
        confined_to.push_back({towards.x(), towards.y(), towards.z()});
    }
    Json json{{"running", status.running},
              {"recording", status.recording.on},
              {"recording_name", status.recording.name},
              {"recording_s", status.recording.seconds},
              {"recording_bytes", status.recording.bytes},
              {"recording_error", status.recording.error},
              {"controls", status.controls},
              {"pages", status.pages},
              {"now_ms", 1e-3 * static_cast<double>(to_us(status.now))},
              {"health", health_json(status.health)},
              {"confined_to", confined_to},
              {"tour", nullptr}};
    if (tour.step >= 0) {
        json["tour"] = {{"step", tour.step},
                        {"compensated", tour.compensated},
                        {"speed", tour.speed},
                        {"other_mm", 1e3 * status.other_error_m}};
    }
    if (!status.levels.is_null()) {
        json["levels"] = status.levels;
    }
    return json;
}

/// Appends a comma, unless an array begins here, and the number; null if there is none.
void put_number(std::string& out, fmt::format_string<double&> form, double value) {
    out += out.back() == '[' ? "" : ",";
    if (std::isfinite(value)) {
        fmt::format_to(std::back_inserter(out), form, value);
    } else {
        out += "null";
    }
}

void put_pose(std::string& out, const TruePose& pose) {
    const auto& [p, q] = pose;
    for (const double part : {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) {
        put_number(out, "{}", part);
    }
}

}  // namespace

void put_compact(const ServedPose& served, std::string& out) {
    const auto& e = served.pose;
    const auto& c = e.covariance;
    fmt::format_to(std::back_inserter(out), "[{},{},{:.3f},{},{}", e.sensor, to_us(e.time),
                   1e-3 * static_cast<double>(to_us(served.utc)), e.flags.bits(), static_cast<int>(e.state));
    put_pose(out, {e.position_m, e.q_source_sensor});
    const double error_m = e.predicted_error ? e.predicted_error->total.position_m : std::nan("");
    for (const double part : {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2), 1e3 * error_m, 1e3 * served.expected_error_m,
                              1e3 * e.distortion_m}) {
        put_number(out, "{:.4g}", part);
    }
    put_number(out, "{:.2f}", e.snr_db);
    if (served.truth) {
        out += ",[";
        put_pose(out, *served.truth);
        out += ']';
    }
    out += ']';
}

Json greeting(const Json& source) {
    Json shown = Json::object();
    for (const char* key : {"kind", "scenario", "device", "tour"}) {
        if (source.contains(key)) {
            shown[key] = source[key];
        }
    }
    const auto flags = flag_names();
    return {{"columns", kCompactColumns},
            {"truth_frame", "source"},
            {"flag_names", std::vector<std::string>(flags.begin(), flags.end())},
            {"invalidating", tracking::kInvalidating.bits()},
            {"states", {to_text(TrackerState::searching), to_text(TrackerState::tracking), to_text(TrackerState::lost)}},
            {"source", shown}};
}

std::string pose_event(std::span<const ServedPose> poses, const PageStatus& status, const Json& hello) {
    Json message{{"status", json_of(status)}};
    if (!hello.is_null()) {
        message["hello"] = hello;
    }
    std::string text = "data: " + json_line(message);
    text.back() = ',';  // instead of the closing brace
    text += "\"poses\":[";
    bool is_first = true;
    for (const ServedPose& served : poses) {
        text += is_first ? "" : ",";
        put_compact(served, text);
        is_first = false;
    }
    return text + "]}\n\n";
}

}  // namespace tricoil::host::web
