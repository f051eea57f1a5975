#include "board/pose_text/candump.hpp"

#include <fmt/format.h>

#include <array>
#include <span>

#include "core/protocol/can_mapping.hpp"
#include "core/protocol/codec.hpp"

namespace tricoil::host {

std::string candump_line(const protocol::PoseMessage& pose) {
    std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes{};
    protocol::CanFrame frame;
    const std::size_t size = protocol::encode(pose, bytes);
    (void)protocol::to_frame(std::span(bytes).first(size), 0, frame);
    std::string line = fmt::format("({:.6f}) tricoil {:03X}##5", 1e-6 * static_cast<double>(pose.time_us), frame.id);
    for (const std::uint8_t byte : frame.bytes()) {
        line += fmt::format("{:02X}", byte);
    }
    return line + "\n";
}

}  // namespace tricoil::host
