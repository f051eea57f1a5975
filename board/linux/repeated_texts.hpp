// Filters repeated texts: reported once, then counted. No heap.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>

namespace tricoil::linux_board {

class RepeatedTexts {
public:
    static constexpr std::int64_t kForgottenUs = 60'000'000;  // a text that did not occur for this time is reported again

    struct Entry {
        std::array<char, 160> text{};
        std::uint64_t unprinted = 0;
        std::int64_t newest_us = 0;
    };

    /// Returns true if `text` must be reported. Otherwise counts it.
    bool should_print(const char* text, std::int64_t now_us) {
        std::array<char, 160> shown{};
        std::snprintf(shown.data(), shown.size(), "%s", text);
        Entry* place = &entries_.front();
        for (Entry& entry : entries_) {
            if (entry.text == shown) {
                const bool forgotten = now_us - entry.newest_us > kForgottenUs;
                entry.newest_us = now_us;
                entry.unprinted += forgotten ? 0 : 1;
                return forgotten;
            }
            place = entry.newest_us < place->newest_us ? &entry : place;
        }
        *place = {shown, 0, now_us};
        return true;
    }

    [[nodiscard]] const std::array<Entry, 24>& entries() const { return entries_; }

private:
    std::array<Entry, 24> entries_{};
};

}  // namespace tricoil::linux_board
