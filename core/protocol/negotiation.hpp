// Negotiation of the protocol version: the newest that both sides support.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/protocol/message_type.hpp"
#include "core/protocol/messages.hpp"

namespace tricoil::protocol {

struct VersionRange {
    std::uint8_t oldest = kOldestVersion;
    std::uint8_t newest = kNewestVersion;
};

/// Newest common version; 0 if there is none. A range with oldest > newest has no common version with any other.
constexpr std::uint8_t common_version(VersionRange a, VersionRange b) {
    const std::uint8_t newest = std::min(a.newest, b.newest);
    return a.oldest <= a.newest && b.oldest <= b.newest && newest >= std::max(a.oldest, b.oldest) ? newest : std::uint8_t{0};
}

/// Argument of the hello command.
constexpr std::uint32_t hello_argument(VersionRange range) {
    return range.oldest | static_cast<std::uint32_t>(range.newest << 8U);
}
constexpr VersionRange range_of_hello(std::uint32_t argument) {
    return {static_cast<std::uint8_t>(argument), static_cast<std::uint8_t>(argument >> 8U)};
}

}  // namespace tricoil::protocol
