#include "board/record/convert.hpp"

#include <array>
#include <functional>

#include "board/pose_text/candump.hpp"
#include "board/pose_text/openigtlink/igtl_messages.hpp"
#include "board/pose_text/pose_lines.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "core/protocol/convert.hpp"

namespace tricoil::host {
namespace {

using Pose = tracking::PoseEstimate<double>;

std::uint64_t for_each_pose(const Recording& recording, const std::function<void(const Pose&)>& take) {
    RecordLines poses(recording.folder(), RecordFile::poses);
    std::uint64_t count = 0;
    for (std::string line; poses.next(line); ++count) {
        take(parse_pose(line, poses.where()));
    }
    return count;
}

/// Messages as a server would send them, stamped with the time in the recording.
std::string igtl_bytes(const Pose& pose) {
    const ServedPose served{pose, utc_time_us(to_us(pose.time))};
    return pose.valid() ? igtl_output::transform_message(served) : igtl_output::status_message(served);
}

}  // namespace

std::uint64_t convert(const Recording& recording, const std::string& form, const std::function<void(std::string_view)>& put) {
    const std::size_t to = index_of_name("--to", form, {"jsonl", "candump", "openigtlink"});
    PoseLineBuffer buffer{};
    const std::array<std::function<void(const Pose&)>, 3> take{
        [&](const Pose& pose) { put(pose_line(protocol::to_message(pose), PoseFormat::json, buffer)); },
        [&](const Pose& pose) { put(candump_line(protocol::to_message(pose))); },
        [&](const Pose& pose) { put(igtl_bytes(pose)); },
    };
    return for_each_pose(recording, take.at(to));
}

}  // namespace tricoil::host
