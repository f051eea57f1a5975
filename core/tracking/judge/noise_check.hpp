// Check of the stated noise of the couplings, independent of the motion model.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/signal/column.hpp"

namespace tricoil::tracking {

/// The process noise follows the innovations. If the stated sigma is too small, the filter therefore mistakes noise for motion
/// and its covariance becomes too small. Third differences of a coil's columns separate the two. For white noise of variance v
/// they have variance 20 v, and consecutive ones have covariance -15 v. Hand motion is smooth over a few columns; its
/// contribution to that covariance is positive.
template <typename Scalar>
class NoiseCheck {
public:
    /// Discards the stored columns, so that no difference includes a restart of the tracker. Keeps the noise estimate.
    void restart() { histories_ = {}; }

    /// Adds a column that the tracker accepted.
    void add(const Column<Scalar>& column) {
        History& h = histories_[static_cast<std::size_t>(coil_index(column.state))];
        const Microseconds step = column.midpoint - h.time;
        const bool evenly = h.depth > 0 && 4 * step < 5 * h.step && 4 * h.step < 5 * step;
        h.depth = evenly || h.depth == 1 ? h.depth + 1 : 1;
        h.time = column.midpoint;
        h.step = step;
        Vec3<Scalar> difference = column.in_phase;
        for (Vec3<Scalar>& last : h.differences) {
            const Vec3<Scalar> next = difference - last;
            last = difference;
            difference = next;
        }
        const Vec3<Scalar> before = h.third;
        h.third = difference;
        if (h.depth > kFirst) {
            const Scalar noise = -difference.cwiseProduct(before).cwiseQuotient(column.sigma.cwiseAbs2()).sum() / (3 * 15);
            const Scalar most = kOutlying * std::max(ratio_, Scalar(1));
            ratio_ += kWeight * (std::clamp(noise, -most, most) - ratio_);
        }
    }

    /// Ratio of the actual to the stated variance if it is larger than chance explains; else 1.
    [[nodiscard]] Scalar excess() const { return ratio_ > kChance ? ratio_ : Scalar(1); }

private:
    static constexpr int kFirst = 4;                   // columns of a coil until two third differences are known
    static constexpr Scalar kWeight = Scalar(1) / 96;  // of one column; 96 columns are 0.13 s of TDM at 240 Hz
    static constexpr Scalar kOutlying = 4;             // values are limited to this multiple of the ratio, against outliers
    static constexpr Scalar kChance = Scalar(1.6);     // four standard deviations of the estimate

    struct History {
        DeviceTime time{};
        Microseconds step{0};
        int depth = 0;
        std::array<Vec3<Scalar>, 3> differences{Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()};  // 0th to 2nd
        Vec3<Scalar> third = Vec3<Scalar>::Zero();
    };
    std::array<History, kSourceCoils> histories_{};
    Scalar ratio_ = 1;
};

}  // namespace tricoil::tracking
