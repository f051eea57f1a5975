// Poses as text, one line each: CSV or JSON. The numbers are those of the wire, in decimal without loss. No heap.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "core/protocol/messages.hpp"

namespace tricoil::host {

enum class PoseFormat : std::uint8_t { csv, json };

/// First line of a CSV file, with its end.
std::string_view pose_csv_header();

/// One line, with its end. Valid as long as `buffer`.
std::string_view pose_line(const protocol::PoseMessage& pose, PoseFormat format, std::array<char, 512>& buffer);

}  // namespace tricoil::host
