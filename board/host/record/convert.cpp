#include "board/host/record/convert.hpp"

#include <fmt/format.h>

#include <array>
#include <functional>

#include "board/host/errors.hpp"
#include "board/host/names.hpp"
#include "board/host/serve/openigtlink/igtl_messages.hpp"
#include "board/linux/pose_lines.hpp"
#include "core/protocol/can_mapping.hpp"
#include "core/protocol/codec.hpp"
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

/// As candump -L writes it: (time) interface ID##FDATA, F: the bit rate is switched.
std::string candump_line(const Pose& pose) {
    std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes{};
    protocol::CanFrame frame;
    const std::size_t size = protocol::encode(protocol::to_message(pose), bytes);
    (void)protocol::to_frame(std::span(bytes).first(size), 0, frame);
    std::string line = fmt::format("({:.6f}) tricoil {:03X}##5", to_seconds(pose.time), frame.id);
    for (const std::uint8_t byte : frame.bytes()) {
        line += fmt::format("{:02X}", byte);
    }
    return line + "\n";
}

/// What a server would have sent, stamped with the time of the recording.
std::string igtl_bytes(const Pose& pose) {
    const ServedPose served{pose, to_us(pose.time)};
    return pose.valid() ? igtl_output::transform_message(served) : igtl_output::status_message(served);
}

}  // namespace

std::uint64_t convert(const Recording& recording, const std::string& form, const std::function<void(std::string_view)>& put) {
    const std::size_t to = index_of_name("--to", form, {"jsonl", "candump", "openigtlink"});
    std::array<char, 512> buffer{};
    const std::array<std::function<void(const Pose&)>, 3> take{
        [&](const Pose& pose) { put(linux_board::pose_line(protocol::to_message(pose), linux_board::PoseFormat::json, buffer)); },
        [&](const Pose& pose) { put(candump_line(pose)); },
        [&](const Pose& pose) { put(igtl_bytes(pose)); },
    };
    return for_each_pose(recording, take.at(to));
}

}  // namespace tricoil::host
