// Poses as CSV or JSON lines. The numbers are those of the wire message, in decimal without loss. No heap.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "core/protocol/messages.hpp"

namespace tricoil::host {

enum class PoseFormat : std::uint8_t { csv, json };

/// First line of a CSV file, with line feed.
std::string_view pose_csv_header();

/// One line, with line feed. Valid while `buffer` is unchanged.
std::string_view pose_line(const protocol::PoseMessage& pose, PoseFormat format, std::array<char, 512>& buffer);

}  // namespace tricoil::host
