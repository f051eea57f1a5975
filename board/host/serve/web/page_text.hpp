// Text of the live page.
#pragma once

#include <algorithm>
#include <string_view>

namespace tricoil::host::web {

extern const std::string_view kPage;

/// At most `length` bytes of `text` from byte `at`. A range that crosses the end of `text` is cut; one that begins at or after
/// the end is empty.
constexpr std::string_view part_of(std::string_view text, std::size_t at, std::size_t length) {
    return text.substr(std::min(at, text.size()), length);
}

}  // namespace tricoil::host::web
