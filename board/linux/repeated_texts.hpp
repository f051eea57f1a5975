// Filters repeated texts: reported once, then counted. No heap.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/base/time.hpp"

namespace tricoil::linux_board {

class RepeatedTexts {
public:
    static constexpr Microseconds kForgotten{60'000'000};  // a text that did not occur for this time is reported again

    struct Entry {
        std::array<char, 160> text{};
        std::uint64_t unprinted = 0;
        HostTime newest{};
    };

    /// Returns true if `text` must be reported. Otherwise counts it.
    bool should_print(const char* text, HostTime now) {
        std::array<char, 160> shown{};
        std::string_view(text).copy(shown.data(), shown.size() - 1);
        Entry* place = &entries_.front();
        for (Entry& entry : entries_) {
            if (entry.text == shown) {
                const bool forgotten = now - entry.newest > kForgotten;
                entry.newest = now;
                entry.unprinted += forgotten ? 0 : 1;
                return forgotten;
            }
            place = entry.newest < place->newest ? &entry : place;
        }
        *place = {shown, 0, now};
        return true;
    }

    [[nodiscard]] const std::array<Entry, 24>& entries() const { return entries_; }

private:
    std::array<Entry, 24> entries_{};
};

}  // namespace tricoil::linux_board
