// Progress of long work on a terminal: "figures: 40 %, 12 s left". Nothing without a terminal or in the first second.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace tricoil::host {

/// Takes the finished part of some work, 0 to 1.
using ShowShare = std::function<void(double)>;

/// "12 s left", from the time so far; empty if it cannot be estimated yet.
std::string time_left(double elapsed_s, double share);

class Progress {
public:
    explicit Progress(std::string label, std::FILE* terminal = stderr);
    /// Removes the line.
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// share: finished part of the work, 0 to 1. Draws at most ten times a second; cheap enough for inner loops.
    void show(double share);
    /// Shows a part of the work: its shares 0 to 1 become `from` to `to`.
    [[nodiscard]] ShowShare part(double from, double to) {
        return [this, from, to](double share) { show(from + (to - from) * share); };
    }

private:
    using Clock = std::chrono::steady_clock;

    std::string label_;
    std::FILE* terminal_;
    bool active_;
    Clock::time_point began_ = Clock::now();
    Clock::time_point due_;
    bool drawn_ = false;
};

}  // namespace tricoil::host
