#include "board/host/serve/web/pose_event.hpp"

#include <nlohmann/json.hpp>

#include "board/host/serve/web/compact_pose.hpp"
#include "board/pose_text/flag_names.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host::web {
namespace {

using Json = nlohmann::ordered_json;
using tracking::TrackerState;

Json json_of(const PageStatus& status) {
    Json confined_to = Json::array();
    for (const Vec3<double>& towards : status.confinement) {
        confined_to.push_back({towards.x(), towards.y(), towards.z()});
    }
    return {{"running", status.running},
            {"recording", status.recording.on},
            {"recording_name", status.recording.name},
            {"recording_s", status.recording.seconds},
            {"recording_bytes", status.recording.bytes},
            {"recording_error", status.recording.error},
            {"controls", status.controls},
            {"pages", status.pages},
            {"now_ms", 1e-3 * static_cast<double>(to_us(status.now))},
            {"health", health_json(status.health)},
            {"confined_to", confined_to}};
}

}  // namespace

Json greeting(const Json& source) {
    Json shown = Json::object();
    for (const char* key : {"kind", "scenario", "device"}) {
        if (source.contains(key)) {
            shown[key] = source[key];
        }
    }
    const auto flags = flag_names();
    return {{"columns", kCompactColumns},
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
    std::string text = "data: " + message.dump(-1, ' ', false, Json::error_handler_t::replace);
    text.back() = ',';  // instead of the closing brace
    text += "\"poses\":[";
    bool is_first = true;
    for (const ServedPose& served : poses) {
        if (is_finite(served.pose)) {
            text += is_first ? "" : ",";
            put_compact(served, text);
            is_first = false;
        }
    }
    return text + "]}\n\n";
}

}  // namespace tricoil::host::web
