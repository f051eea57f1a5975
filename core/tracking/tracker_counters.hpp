// Counters of a tracker.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tricoil::tracking {

/// Reason for which a column is refused.
enum class Rejection : std::uint8_t { not_finite, bad_sigma, unknown_state, time_backwards, duplicate, time_ahead };
constexpr std::size_t kRejections = 6;

struct TrackerCounters {
    std::uint64_t accepted = 0;
    std::array<std::uint64_t, kRejections> rejected{};  // by Rejection
    std::uint64_t poses = 0;
    std::uint64_t invalid_poses = 0;
    std::uint64_t acquisitions = 0;           // searching or lost -> tracking
    std::uint64_t outliers = 0;               // columns refused by the filter's gate
    std::uint64_t covariance_inflations = 0;  // times the covariance was increased to follow a manoeuvre
    std::uint64_t clock_restarts = 0;         // restarts of the device clock
    std::uint64_t reacquisitions = 0;         // times the filter lost the sensor and started again from the direct solution

    [[nodiscard]] std::uint64_t of(Rejection reason) const { return rejected[static_cast<std::size_t>(reason)]; }
};

}  // namespace tricoil::tracking
