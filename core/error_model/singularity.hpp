// Singularity of the angle form: beta - e_beta = +-(2n + 1) pi/2, remark 2 of the paper.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "core/base/time.hpp"

namespace tricoil::error_model {

/// Detects passages of an elevation (measured, or predicted as beta - e_beta) through odd quarter turns.
template <typename Scalar>
class SingularityDetector {
public:
    SingularityDetector(Scalar elevation_rad, DeviceTime time)
        : half_turn_(half_turn_of(elevation_rad)), elevation_rad_(elevation_rad), time_(time) {}

    /// Time of a passage between the last update and this one, by linear interpolation; nullopt if there was none.
    /// Several passages in one update are reported as one, at the first pole.
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
    /// Index of the half turn that contains the elevation. Half turns are centred on multiples of pi; the poles are their limits.
    static Scalar half_turn_of(Scalar elevation_rad) { return std::round(elevation_rad / std::numbers::pi_v<Scalar>); }

    Scalar half_turn_;
    Scalar elevation_rad_;
    DeviceTime time_;
};

}  // namespace tricoil::error_model
