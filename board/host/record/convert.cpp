#include "board/host/record/convert.hpp"

#include <fmt/format.h>

#include <array>
#include <functional>

#include "board/host/errors.hpp"
#include "board/host/names.hpp"
#include "board/linux/pose_writer.hpp"
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

}  // namespace

std::uint64_t convert(const Recording& recording, const std::string& form, std::FILE* out, const std::string& out_name) {
    std::uint64_t count = 0;
    if (index_of_name("--to", form, {"jsonl", "candump"}) == 0) {
        linux_board::PoseWriter writer(out, linux_board::PoseFormat::json);
        count = for_each_pose(recording, [&](const Pose& pose) { writer.write(protocol::to_message(pose)); });
    } else {
        count = for_each_pose(recording, [&](const Pose& pose) { std::fputs(candump_line(pose).c_str(), out); });
    }
    if (std::fflush(out) != 0 || std::ferror(out) != 0) {
        throw DeviceError(out_name + ": could not be written completely; is the disk full?");
    }
    return count;
}

}  // namespace tricoil::host
