// Keeps a simulation or a recording at the pace of real time.
#pragma once

#include <chrono>
#include <optional>

#include "core/base/time.hpp"

namespace tricoil::host {

/// More than 250 ms lost by a pause or a busy machine are not made up.
class Pacer {
public:
    using Duration = std::chrono::microseconds;

    /// Real time until `elapsed`, time of the source since its start, is reached; zero or negative: it is.
    Duration left(Microseconds elapsed) {
        const auto now = std::chrono::steady_clock::now();
        const Duration played{elapsed.count()};
        if (!start_ || now - (*start_ + played) > kMaxBehind) {
            start_ = now - played;
        }
        return std::chrono::duration_cast<Duration>(*start_ + played - now);
    }

private:
    static constexpr std::chrono::milliseconds kMaxBehind{250};
    std::optional<std::chrono::steady_clock::time_point> start_;
};

}  // namespace tricoil::host
