#include "board/host/serve/web/pose_event.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "board/pose_text/flag_names.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host::web {
namespace {

using Json = nlohmann::ordered_json;

/// The fields of a pose in all text forms, and those that only the page needs.
Json json_of(const ServedPose& served) {
    const auto& e = served.pose;
    const auto& c = e.covariance;
    const PoseNumbers numbers = numbers_of(e);
    Json pose;
    for (const PoseField& field : pose_fields()) {
        if (field.integer != nullptr) {
            pose[field.key] = numbers.*field.integer;
        } else if (field.is_names()) {
            pose[field.key] = to_text(e.flags);
        } else if (const auto values = field.numbers(numbers); values.size() == 1) {
            pose[field.key] = values.front();
        } else {
            pose[field.key] = std::vector<double>(values.begin(), values.end());
        }
    }
    pose["utc_ms"] = 1e-3 * static_cast<double>(to_us(served.utc));
    pose["position_covariance_m2"] = {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)};
    pose["stale"] = e.flags.has(tracking::PoseFlag::stale);
    pose["advice"] = advice(e.flags);
    pose["state_name"] = to_text(e.state);
    pose["predicted_error_mm"] = e.predicted_error ? Json(1e3 * e.predicted_error->total.position_m) : Json(nullptr);
    return pose;
}

}  // namespace

std::string pose_event(std::span<const ServedPose> poses, const PageStatus& status) {
    std::array<const ServedPose*, tracking::kMaxSensors> newest{};
    for (const ServedPose& served : poses) {
        if (served.pose.sensor < newest.size() && served.pose.position_m.allFinite() && served.pose.covariance.allFinite()) {
            newest[served.pose.sensor] = &served;
        }
    }
    Json message{{"status",
                  {{"running", status.running},
                   {"recording", status.recording},
                   {"recording_error", status.recording_error},
                   {"controls", status.controls},
                   {"health", health_json(status.health)}}},
                 {"poses", Json::array()}};
    for (const ServedPose* served : newest) {
        if (served != nullptr) {
            message["poses"].push_back(json_of(*served));
        }
    }
    return "data: " + message.dump() + "\n\n";
}

}  // namespace tricoil::host::web
