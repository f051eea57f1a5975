// Whether the couplings are as noisy as they say: what no motion model can take for motion.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/signal/column.hpp"

namespace tricoil::tracking::scaat {

/// The process noise follows the innovations, so a filter that is told too small a sigma takes the noise for motion and believes
/// in it. Third differences of a coil's columns tell the two apart: of white noise of variance v they have variance 20 v and,
/// from one to the next, covariance -15 v; what a hand does within a few columns is smooth, and adds to that covariance rather
/// than takes.
template <typename Scalar>
class NoiseCheck {
public:
    /// The filter starts anew: no difference across that. What is known of the noise stays.
    void restart() { histories_ = {}; }

    /// Takes a column that the filter believed in.
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

    /// The variance there is over the one stated, where it is larger than chance explains; else 1.
    [[nodiscard]] Scalar excess() const { return ratio_ > kChance ? ratio_ : Scalar(1); }

private:
    static constexpr int kFirst = 4;                   // columns of a coil until two third differences are known
    static constexpr Scalar kWeight = Scalar(1) / 96;  // of a column: 0.13 s of TDM at 240 Hz
    static constexpr Scalar kOutlying = 4;             // what is beyond so many times the ratio counts as that: an outlier
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

}  // namespace tricoil::tracking::scaat
