// Notices that clients cause.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "board/support/terminal_text.hpp"

namespace tricoil::host {

/// At most kMost lines in a period, so that clients cannot fill a log. The next line says how many were left out. One thread at a
/// time.
class LimitedNotice {
public:
    static constexpr int kMost = 20;
    static constexpr std::chrono::seconds kPeriod{10};

    /// name: of the output.
    explicit LimitedNotice(std::string name) : name_(std::move(name)) {}

    [[nodiscard]] const std::string& name() const { return name_; }

    void print(const std::string& text) {
        const auto now = std::chrono::steady_clock::now();
        if (now - begin_ >= kPeriod) {
            begin_ = now;
            printed_ = 0;
        }
        if (printed_ == kMost) {
            ++left_out_;
            return;
        }
        ++printed_;
        const int left_out = std::exchange(left_out_, 0);
        print_notice("tricoil: {}: {}{}\n", name_, text, left_out > 0 ? fmt::format(" ({} lines left out)", left_out) : "");
    }

private:
    std::string name_;
    std::chrono::steady_clock::time_point begin_{};
    int printed_ = 0;   // in this period
    int left_out_ = 0;  // since the last line
};

}  // namespace tricoil::host
