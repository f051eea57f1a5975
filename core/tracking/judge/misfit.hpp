// Misfit of the couplings: the part that pose, noise and motion do not explain, and the pose error that it suggests.
#pragma once

#include <algorithm>

#include "core/base/time.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Ratio assumed between a distortion's standard deviation in the six directions of the couplings that a pose explains and in the
/// three others, which the misfit shows. Metal acts on all nine couplings; it is not known how much of it lies in the six. With
/// this ratio, errors exceed five standard deviations for few of the aluminium spheres of tests/honesty.
constexpr double kHiddenShare = 2.5;

/// Follows the misfit of consecutive signal matrices. A significant misfit counts once, because a single one may be chance (once
/// in 40 s at 240 Hz). After two in a row the variance decays slowly, because near metal the misfit passes through zero while the
/// sensor moves. It decays faster after 0.15 s without two in a row. A smaller misfit counts if it lasts. Metal that
/// appears suddenly looks like a very fast motion for some columns: a misfit that almost only motion explains is doubtful, and
/// widens the covariance.
template <typename Scalar>
class Misfit {
public:
    /// squared: squared misfit, 3 degrees of freedom. expected: variance of a coupling from noise, motion and calibration, in the
    /// same unit squared; still: the same without motion. gate: chi-square above which the misfit is significant. share: of the
    /// squared error of this matrix that the pose has; a filter takes only a part of one matrix.
    void add(Scalar squared, Scalar expected, Scalar still, Scalar gate, DeviceTime time, Scalar share = 1) {
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
        const Scalar last = 3 * ratio > gate ? squared / 3 : Scalar(0);
        if (last > 0 && last_ > 0) {
            held_ = std::max({held_, last_, last});
            quiet_s_ = 0;
        }
        last_ = last;
        share_ = share;
        const Scalar most = Scalar(kMostlyMotion) * still;
        doubtful_ = 3 * ratio > Scalar(kDoubtfulAbove) && expected > most ? squared / 3 : Scalar(0);
        lasting_ = std::max(mean_ratio_ - Scalar(kChance), Scalar(0)) * std::min(expected, most);
    }

    /// Variance of a coupling that the recent misfit suggests in the directions that a pose explains; zero if it is not
    /// significant.
    [[nodiscard]] Scalar variance() const {
        return Scalar(kHiddenShare * kHiddenShare) * std::max({share_ * last_, held_, lasting_});
    }

    /// variance(), and that of the last misfit if it is doubtful: for the covariance.
    [[nodiscard]] Scalar covered_variance() const {
        return std::max(variance(), Scalar(kHiddenShare * kHiddenShare) * doubtful_);
    }

private:
    static constexpr double kMemory_s = 0.1;
    static constexpr double kPassing_s = 0.15;     // near metal the misfit of a moving sensor passes through zero in less time
    static constexpr double kMaxElapsed_s = 0.02;  // a longer gap counts as this
    static constexpr double kLongMemory_s = 0.4;
    static constexpr double kChance = 1.2;  // mean ratio of 190 independent matrices: more than three standard deviations above 1
    static constexpr double kMaxRatio = 10;      // limits how long the mean remembers a large misfit
    static constexpr double kDoubtfulAbove = 9;  // chi-square, 3 degrees of freedom: exceeded once in 34
    static constexpr double kMostlyMotion = 25;  // of the expected variance to that without motion

    Scalar last_ = 0;        // variance of a coupling if the last misfit was significant; else zero
    Scalar share_ = 1;       // of last_ that the pose has
    Scalar held_ = 0;        // the same, decaying; zero until two in a row were significant
    Scalar lasting_ = 0;     // the same from the mean ratio
    Scalar doubtful_ = 0;    // variance of a coupling of the last misfit if that is doubtful; else zero
    Scalar mean_ratio_ = 1;  // of misfit to its expectation
    Scalar quiet_s_ = 0;     // since two significant misfits in a row
    bool started_ = false;
    DeviceTime time_{};
};

/// Variance of a coupling due to errors of the calibration, for the covariance of poses; zero if negligible. strength: k.
template <typename Scalar>
Scalar floor_variance(const CommonParams<Scalar>& params, Scalar strength) {
    constexpr Scalar kNegligible = Scalar(1e-5);
    return params.misfit_floor > kNegligible || params.pick_up_sigma > 0
               ? params.calibration_variance(strength, params.floor_share)
               : Scalar(0);
}

/// Root mean square of the position error that an error of `sigma` in each coupling causes: the trace of pose_covariance().
template <typename Scalar>
Scalar position_deviation(Scalar strength, Scalar range_m, Scalar sigma) {
    constexpr Scalar kPerRange = Scalar(2.1256);  // sqrt(1 / 13.5 + 2 * 1.25 / 0.5625)
    return kPerRange * range_m * sigma / strength;
}

/// Share of the deviation due to metal that the distortion figure states. The covariance contains all of it; the median error
/// beside 2,000 random metal objects is about a third of it (tests/honesty). With this share the median of the figure is 1.7 to
/// 2.0 errors (two bands: 2.1), and 95 % of the errors are less than twice the figure.
constexpr double kLikelyShare = 0.65;

/// Error of the position that the hidden part of a misfit, `sigma` of each coupling, suggests.
template <typename Scalar>
Scalar likely_distortion(Scalar strength, Scalar range_m, Scalar sigma) {
    return Scalar(kLikelyShare) * position_deviation(strength, range_m, sigma);
}

}  // namespace tricoil::tracking
