// Estimates the effect of metal in the low band relative to the high band, from the misfits of both bands.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/tracking/metal/pose_information.hpp"

namespace tricoil::tracking {

/// Three of nine couplings are redundant. No pose changes them, so there the low band's misfit is `share` times that of the high
/// band, at rest as well as in motion. Non-magnetic conductors have shares of 0 to 0.9. Ferromagnetic metal attracts the field
/// along itself, most in the low band, and expels it across: its share differs between the couplings, and is often above 1 or
/// negative. Metal whose share is near 1 cannot be told from a change of pose.
///
/// It needs coils whose calibration leaves little misfit of its own. `tricoil couplings` uses changes of the misfit instead.
class BandShare {
public:
    /// frames: length of the windows.
    explicit BandShare(int frames) : frame_weight_(1.0 / frames) {}

    /// Means over a window, once a frame, in coupling units. variance: of one low coupling. floor_variance: misfit of calibrated
    /// coils per coupling.
    void add(const Vec9& low, const Vec9& high, double variance, double floor_variance) {
        const double weight = variance > 0 ? frame_weight_ / variance : 0;
        low_high_ = (1 - frame_weight_) * low_high_ + weight * low.dot(high);
        high_high_ = (1 - frame_weight_) * high_high_ + weight * high.squaredNorm();
        const double rest = (low - value() * high).squaredNorm();
        const double unexplained = std::max(rest - 3 * variance, 0.0) / 3;  // shares differ between the couplings
        constexpr double kSignificant = 20;                                 // chi-square of three degrees of freedom
        constexpr double kUnexplained = 0.3;
        differs_ = rest > kSignificant * (variance + floor_variance) &&
                   rest > kUnexplained * kUnexplained * (low.squaredNorm() + high.squaredNorm());
        by_model_ = (unexplained + 3 * floor_variance) / std::max(high.squaredNorm(), 1e-30);
    }

    [[nodiscard]] double value() const { return (low_high_ + kPrior * kPriorWeight) / (high_high_ + kPriorWeight); }
    [[nodiscard]] double sigma() const {
        const double spread = kSpread * value();
        return std::sqrt(1 / (high_high_ + kPriorWeight) + by_model_ + spread * spread);
    }
    /// True if no non-magnetic conductor has such a share, or if the misfits of the bands differ by more than a factor.
    [[nodiscard]] bool is_ferromagnetic() const {
        const double noise = 2 / std::sqrt(high_high_ + kPriorWeight);
        return value() < -noise || value() > 1 + noise || differs_;
    }
    /// Bias of the high band divided by the difference of the bands.
    [[nodiscard]] double gain() const { return 1 / apart(); }
    [[nodiscard]] double gain_sigma() const { return sigma() / (apart() * apart()); }

private:
    static constexpr double kPrior = 0.5;
    static constexpr double kPriorWeight = 1;     // sigma 1
    static constexpr double kSpread = 0.2;        // of the share between couplings, relative
    static constexpr double kLeastApart = 0.125;  // of the bands; beyond it the gain only amplifies noise

    [[nodiscard]] double apart() const {
        const double apart = 1 - value();
        return std::copysign(std::max(std::abs(apart), kLeastApart), apart);
    }

    double frame_weight_;
    double low_high_ = 0;
    double high_high_ = 0;
    double by_model_ = 0;
    bool differs_ = false;  // significantly between the couplings
};

}  // namespace tricoil::tracking
