#include "board/pose_text/mcap/mcap_poses.hpp"

#include <fmt/format.h>

#include <utility>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/json_text.hpp"
#include "core/base/time.hpp"

namespace tricoil::host {
namespace {

constexpr std::uint64_t kNanosecondsPerMicrosecond = 1000;
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

constexpr const char* kPoseInFrame = R"({
  "title": "foxglove.PoseInFrame", "type": "object", "properties": {
    "timestamp": {"type": "object", "title": "time", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
    "frame_id": {"type": "string"},
    "pose": {"type": "object", "title": "foxglove.Pose", "properties": {
      "position": {"type": "object", "title": "foxglove.Vector3",
        "properties": {"x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}}},
      "orientation": {"type": "object", "title": "foxglove.Quaternion",
        "properties": {"x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}, "w": {"type": "number"}}}}}}})";

/// Of the JSON text of a pose.
std::string pose_schema(const PoseUnits& units) {
    const Json number{{"type", {"number", "null"}}};
    Json properties = Json::object();
    for_each_field(kPoseForm, units, [&](const PoseField& field) {
        properties[pose_key(field, units)] = field.integer != nullptr ? Json{{"type", "integer"}}
                                             : field.is_names()       ? Json{{"type", "string"}}
                                             : field.count > 1        ? Json{{"type", "array"}, {"items", number}}
                                                                      : number;
    });
    return Json{{"title", "tricoil.Pose"}, {"type", "object"}, {"properties", properties}}.dump();
}

std::string pose_in_frame(const tracking::PoseEstimate<double>& pose, std::uint64_t time_ns, const std::string& frame) {
    const Vec3<double>& p = pose.position_m;
    const Quat<double>& q = pose.q_source_sensor;
    return Json{{"timestamp", {{"sec", time_ns / kNanosecondsPerSecond}, {"nsec", time_ns % kNanosecondsPerSecond}}},
                {"frame_id", frame},
                {"pose",
                 {{"position", {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}},
                  {"orientation", {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}}}}}
        .dump();
}

}  // namespace

McapPoses::McapPoses(std::function<void(std::string_view)> put, PoseUnits units, std::string frame)
    : writer_(std::move(put), "tricoil"), units_(std::move(units)), frame_(std::move(frame)) {}

void McapPoses::add(const tracking::PoseEstimate<double>& pose) {
    auto& channels = sensors_.at(pose.sensor);
    if (!channels) {
        channels =
            Channels{writer_.add_channel(fmt::format("/sensor{}/tracker", pose.sensor), "tricoil.Pose", pose_schema(units_)),
                     writer_.add_channel(fmt::format("/sensor{}/pose", pose.sensor), "foxglove.PoseInFrame", kPoseInFrame)};
    }
    const std::uint64_t time_ns =
        kNanosecondsPerMicrosecond * static_cast<std::uint64_t>(std::max<std::int64_t>(to_us(pose.time), 0));
    std::array<char, kLongestPoseText> text;
    writer_.add_message(channels->tracker, pose.sequence, time_ns, {text.data(), put_json({pose}, kPoseForm, units_, text)});
    if (pose.valid()) {
        writer_.add_message(channels->pose, pose.sequence, time_ns, pose_in_frame(pose, time_ns, frame_));
    }
}

}  // namespace tricoil::host
