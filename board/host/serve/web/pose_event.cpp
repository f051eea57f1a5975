#include "board/host/serve/web/pose_event.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "board/pose_text/flag_names.hpp"
#include "core/base/angle_units.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host::web {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const ServedPose& served) {
    const auto& e = served.pose;
    const auto& q = e.q_source_sensor;
    const auto& c = e.covariance;
    Json pose{{"sensor", e.sensor},
              {"t", 1e-3 * static_cast<double>(to_us(served.utc))},
              {"p", {e.position_m.x(), e.position_m.y(), e.position_m.z()}},
              {"q", {q.w(), q.x(), q.y(), q.z()}},
              {"c", {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)}},
              {"valid", e.valid()},
              {"stale", e.flags.has(tracking::PoseFlag::stale)},
              {"flags", to_text(e.flags)},
              {"advice", advice(e.flags)},
              {"state", to_text(e.state)},
              {"snr", e.snr_db},
              {"distortion", e.distortion_chi_square},
              {"error", nullptr}};
    if (e.predicted_error) {
        pose["error"] = {1e3 * e.predicted_error->total.position_m, kDegrees * e.predicted_error->total.rotation_rad};
    }
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
                   {"controls", status.controls}}},
                 {"poses", Json::array()}};
    for (const ServedPose* served : newest) {
        if (served != nullptr) {
            message["poses"].push_back(json_of(*served));
        }
    }
    return "data: " + message.dump() + "\n\n";
}

}  // namespace tricoil::host::web
