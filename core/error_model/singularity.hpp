// When the angle form becomes singular: beta - e_beta = +-(2n + 1) pi/2, remark 2 of the paper.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "core/base/time.hpp"

namespace tricoil::error_model {

/// Watches an elevation (measured, or predicted as beta - e_beta) for passages through odd quarter turns.
template <typename Scalar>
class SingularityDetector {
public:
    SingularityDetector(Scalar elevation_rad, DeviceTime time)
        : half_turn_(half_turn_of(elevation_rad)), elevation_rad_(elevation_rad), time_(time) {}

    /// The instant of the passage between the last update and this one, interpolated linearly; none if there was no passage.
    /// More than one passage in one update is reported once, at the first pole met.
    std::optional<DeviceTime> update(Scalar elevation_rad, DeviceTime time) {
        const Scalar half_turn = half_turn_of(elevation_rad);
        std::optional<DeviceTime> passage;
        if (half_turn != half_turn_) {
            const Scalar quarter = std::numbers::pi_v<Scalar> / 2;
            const Scalar towards = half_turn > half_turn_ ? quarter : -quarter;
            const Scalar pole = half_turn_ * 2 * quarter + towards;
            const Scalar share = (pole - elevation_rad_) / (elevation_rad - elevation_rad_);
            const auto span_us = static_cast<double>((time - time_).count());
            passage = time_ + Microseconds{static_cast<std::int64_t>(std::floor(static_cast<double>(share) * span_us))};
        }
        half_turn_ = half_turn;
        elevation_rad_ = elevation_rad;
        time_ = time;
        return passage;
    }

private:
    /// Number of the half turn, centred on whole half turns, that an elevation lies in: poles are its borders.
    static Scalar half_turn_of(Scalar elevation_rad) { return std::round(elevation_rad / std::numbers::pi_v<Scalar>); }

    Scalar half_turn_;
    Scalar elevation_rad_;
    DeviceTime time_;
};

}  // namespace tricoil::error_model
