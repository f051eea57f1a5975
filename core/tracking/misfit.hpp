// Misfit of the couplings: what neither a pose nor noise nor motion explains, and the error of the pose that it suggests.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/time.hpp"
#include "core/solver/pose_covariance.hpp"

namespace tricoil::tracking {

/// Ratio assumed between a distortion's standard deviation in the six directions of the couplings that a pose explains and in the
/// three others, which the misfit shows. Metal acts on all nine couplings; it is not known how much of it lies in the six. With
/// this ratio, errors exceed five standard deviations for few of the conducting spheres of tests/honesty.
constexpr double kHiddenShare = 2.5;

/// Follows the misfit of consecutive signal matrices. A single misfit counts if it is significant; a smaller one counts if it
/// lasts. A significant misfit decays slowly, because near metal it passes through zero while the sensor moves; faster when it
/// stays away.
template <typename Scalar>
class Misfit {
public:
    /// squared: squared misfit, 3 degrees of freedom. expected: variance of a coupling from noise, motion and calibration, in the
    /// same unit squared. gate: chi-square above which the misfit is significant.
    void add(Scalar squared, Scalar expected, Scalar gate, DeviceTime time) {
        const Scalar elapsed_s = std::clamp(seconds_as<Scalar>(time - time_), Scalar(0), Scalar(kMaxElapsed_s));
        const bool started_before = started_;
        const Scalar weight = started_before ? elapsed_s / (elapsed_s + Scalar(kMemory_s)) : Scalar(0);
        const Scalar ratio = squared / (3 * expected);
        time_ = time;
        started_ = true;
        quiet_s_ += elapsed_s;
        held_ *= quiet_s_ > Scalar(kPassing_s) ? (1 - weight) * (1 - weight) * (1 - weight) : 1 - weight;
        const Scalar slow = started_before ? elapsed_s / (elapsed_s + Scalar(kLongMemory_s)) : Scalar(0);
        mean_ratio_ += slow * (std::min(ratio, Scalar(kMaxRatio)) - mean_ratio_);
        if (3 * ratio > gate) {
            held_ = std::max(held_, squared / 3);
            quiet_s_ = 0;
        }
        lasting_ = std::max(mean_ratio_ - Scalar(kChance), Scalar(0)) * expected;
    }

    /// Variance of a coupling that the recent misfit suggests in the directions that a pose explains; zero if it is not
    /// significant.
    [[nodiscard]] Scalar variance() const { return Scalar(kHiddenShare * kHiddenShare) * std::max(held_, lasting_); }

private:
    static constexpr double kMemory_s = 0.1;
    static constexpr double kPassing_s = 0.15;     // near metal a moving sensor's misfit is small for a shorter time
    static constexpr double kMaxElapsed_s = 0.02;  // a longer gap counts as this
    static constexpr double kLongMemory_s = 0.4;
    static constexpr double kChance = 1.2;   // mean ratio of 190 independent matrices: three standard deviations above 1
    static constexpr double kMaxRatio = 10;  // limits how long the mean remembers a large misfit

    Scalar held_ = 0;        // variance of a coupling, decaying
    Scalar lasting_ = 0;     // the same from the mean ratio
    Scalar mean_ratio_ = 1;  // of misfit to its expectation
    Scalar quiet_s_ = 0;     // since the last significant misfit
    DeviceTime time_{};
    bool started_ = false;
};

/// Root mean square of the position error that an error of `sigma` in each coupling causes: the trace of pose_covariance().
template <typename Scalar>
Scalar position_deviation(Scalar strength, Scalar range_m, Scalar sigma) {
    constexpr Scalar kPerRange = Scalar(2.1256);  // sqrt(1 / 13.5 + 2 * 1.25 / 0.5625)
    return kPerRange * range_m * sigma / strength;
}

}  // namespace tricoil::tracking
