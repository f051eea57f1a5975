// Poses as CSV or JSON lines. The numbers are those of the wire message, in decimal without loss. No heap.
#pragma once

#include <array>
#include <string_view>

#include "board/pose_text/pose_fields.hpp"

namespace tricoil::host {

enum class PoseFormat : std::uint8_t { csv, json };

using PoseLineBuffer = std::array<char, kLongestPoseText + 1>;

/// One line, with line feed. Valid while `buffer` is unchanged. The first line of a CSV file is pose_column_names().
inline std::string_view pose_line(const protocol::PoseMessage& pose, PoseFormat format, PoseLineBuffer& buffer) {
    const PoseNumbers numbers = numbers_of(pose);
    const std::size_t size = format == PoseFormat::csv ? put_csv(numbers, buffer) : put_json(numbers, buffer);
    buffer[size] = '\n';
    return {buffer.data(), size + 1};
}

}  // namespace tricoil::host
