// What a tracker counts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tricoil::tracking {

/// Why a column was refused.
enum class Rejection : std::uint8_t { not_finite, bad_sigma, unknown_state, time_backwards, duplicate, time_ahead };
constexpr std::size_t kRejections = 6;

struct TrackerCounters {
    std::uint64_t accepted = 0;
    std::array<std::uint64_t, kRejections> rejected{};  // by Rejection
    std::uint64_t poses = 0;
    std::uint64_t invalid_poses = 0;
    std::uint64_t acquisitions = 0;           // searching or lost -> tracking
    std::uint64_t outliers = 0;               // columns that the filter's gate refused
    std::uint64_t covariance_inflations = 0;  // times the prediction's covariance was multiplied to follow a manoeuvre
    std::uint64_t clock_restarts = 0;         // times the stamps began anew
    std::uint64_t reacquisitions = 0;         // times the filter lost the sensor and started anew from the direct solution

    [[nodiscard]] std::uint64_t of(Rejection reason) const { return rejected[static_cast<std::size_t>(reason)]; }
};

}  // namespace tricoil::tracking
