#include "board/pose_text/served_pose_line.hpp"

#include <fmt/format.h>

#include "board/pose_text/pose_fields.hpp"

namespace tricoil::host {
namespace {

constexpr std::int64_t kMicrosecondsPerSecond = 1'000'000;

}  // namespace

std::string served_pose_line(const ServedPose& served) {
    std::array<char, kLongestPoseText> text{};
    const std::size_t size = put_json(numbers_of(served.pose), text);
    const std::string_view fields(text.data(), size - 1);  // without the closing brace
    const std::int64_t utc_us = to_us(served.utc);
    return fmt::format("{},\"utc_s\":{}.{:06}}}\n", fields, utc_us / kMicrosecondsPerSecond, utc_us % kMicrosecondsPerSecond);
}

}  // namespace tricoil::host
