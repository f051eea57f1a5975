// Process noise and consistency of the filter, from its innovations.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tracking/scaat/column_update.hpp"
#include "core/tracking/scaat/process_noise.hpp"

namespace tricoil::tracking::scaat {

/// Factor on the reported covariance. Over the recorded motions squared errors are 0.9 to 1.0 of the filter's own covariance, but
/// one second of motion has only about twenty independent errors.
constexpr double kCovarianceMargin = 1.1;

/// Lag of position (m) or attitude (rad) behind an acceleration that the process noise does not follow yet. Corrections without
/// lag are white; a lag gives them a mean, the share of it that a column corrects. Far from the source, where noise hides it in
/// single innovations, errors of hands were three stated deviations. Images have no room for it.
template <typename Scalar>
struct Lag {
    void add(auto&&...) {}
    void cover(auto&&) const {}
};
template <>
struct Lag<double> {
    Vec3<double> mean = Vec3<double>::Zero();  // of the corrections, over the memory of the filter
    double variance = 0;                       // of the mean without lag, sum of three axes
    double share = 1;                          // of a lag that one column corrects

    /// before, after: variance of the state before and after the correction, sum of three axes.
    void add(const Vec3<double>& correction, double before, double after) {
        const double now = std::max(1 - after / before, 1e-6);
        const double weight = std::clamp(now, 0.03, 0.5);
        mean += weight * (correction - mean);
        variance += weight * (weight * (before - after) - (2 - weight) * variance);
        share += weight * (now - share);
    }
    void cover(auto&& covariance) const {
        constexpr double kChance = 4;  // mean of three squares: exceeded once in 129 if all axes count, once in 22 if one does
        const double beyond = std::max(0.0, 1 - kChance * variance / mean.squaredNorm());  // zero also without corrections
        covariance += beyond / (share * share) * mean * mean.transpose();
    }
};

/// Share of a limit for three couplings that is exceeded as often by so many couplings (chi-square, once in about 30).
constexpr std::array kLimitShare{0.52, 0.78, 1.0};

/// Squared innovation relative to the value above which the variance of a column is multiplied by the third power of the excess.
/// Tuned for outliers of 5 to 15 sigma in one column of 20 of a moving sensor. Without outliers it reduces the accuracy by 3 %.
template <typename Scalar>
Scalar excess_of(Scalar nis, std::size_t couplings = 3) {
    return nis / Scalar(9 * kLimitShare[couplings - 1]);  // exceeded once in 34
}
template <typename Scalar>
void reduce_weight(Innovation<Scalar>& innovation, Scalar excess) {
    if (excess > 1) {
        innovation.set_noise(excess * excess * excess * innovation.r);
    }
}

constexpr int kMaxInflations = 4;

template <typename Scalar>
class Adaptation {
public:
    explicit Adaptation(const ScaatParams<Scalar>& params)
        : translation_limits_{std::log(params.process.least_m2_s3), std::log(params.process.most_m2_s3)},
          rotation_limits_{std::log(params.process.least_rad2_s3), std::log(params.process.most_rad2_s3)} {
        restart(params.process);
    }

    void restart(const ProcessNoiseParams<Scalar>& params) {
        translation_ = {std::log(params.start_m2_s3)};
        rotation_ = {std::log(params.start_rad2_s3)};
        consistency_ = 1;
        outlier_inflation_ = 0;
    }

    /// Adds the innovation of a column, before the update of `state`. whitened: with the full weight of the column. settled: the
    /// velocity is known. couplings: of the column, 1 to 3; other rows of the innovation are zero.
    void add(const ScaatParams<Scalar>& params, const State<Scalar>& state, const Innovation<Scalar>& innovation,
             const Vec3<Scalar>& whitened, bool in_frame, bool settled, std::size_t couplings = 3) {
        // An outlier that just passes the gate moves the pose by several sigma. The reported covariance is increased until later
        // columns have corrected the pose.
        constexpr double kInflateAbove = 8.5;  // squared innovation, 3 degrees of freedom: exceeded once in 27
        constexpr Scalar kInflationDecay = Scalar(0.96);
        const Scalar nis = whitened.squaredNorm();
        const Scalar inflation = nis / Scalar(kInflateAbove * kLimitShare[couplings - 1]);
        outlier_inflation_ = std::max(inflation, kInflationDecay * outlier_inflation_);
        if (settled) {
            adapt_process_noise(params.process, state, innovation, whitened, in_frame);
            consistency_ += params.consistency_gain * (nis / Scalar(couplings) - consistency_);
        }
    }

    void inflate(Scalar factor) {
        const Scalar log_factor = std::log(factor);
        translation_.log_q = std::min(translation_.log_q + log_factor, translation_limits_.most);
        rotation_.log_q = std::min(rotation_.log_q + log_factor, rotation_limits_.most);
    }

    [[nodiscard]] Intensity<Scalar> intensity() const { return {std::exp(translation_.log_q), std::exp(rotation_.log_q)}; }
    /// Windowed mean of squared innovations per degree of freedom; expectation 1.
    [[nodiscard]] Scalar consistency() const { return consistency_; }
    /// Factor by which recent innovations exceed the covariance.
    [[nodiscard]] Scalar covariance_factor() const { return std::max(consistency_, outlier_inflation_); }

private:
    // The process noise does not fall while the standard deviation of the pose is below this share of the range, and below this
    // angle: a filter that is still quieter lags when a hand starts to move. Chosen on recorded hand motions without noise.
    static constexpr double kFineEnough = 4e-5;

    /// Adapts the process noise with the original innovation, but with the reduced weight of the column. In a frame, the first
    /// column correlates the errors of position and rotation. The shares of the two then add up to more than the share of the
    /// whole prediction, the Fisher information is too large, and the steps of log q are too small: after a fast motion q stays
    /// high. Both shares are therefore scaled to the share of the prediction. In TDM this has little effect and is left out.
    void adapt_process_noise(const ProcessNoiseParams<Scalar>& params, const State<Scalar>& state,
                             const Innovation<Scalar>& innovation, const Vec3<Scalar>& whitened, bool in_frame) {
        const auto adapt_block = [&](int block, Scalar unit_squared, DensityLimits<Scalar> limits, DensityEstimate<Scalar>& q,
                                     const Mat3<Scalar>& share) {
            const Scalar variance = state.covariance.template block<3, 3>(block, block).trace();
            if (variance < Scalar(kFineEnough * kFineEnough) * unit_squared) {
                limits.least = std::max(limits.least, q.log_q);
            }
            adapt(q, limits, share, whitened, params);
        };
        const auto share = [&](int block) -> Mat3<Scalar> {
            const Matrix<Scalar, 3, 3> h = innovation.h.template middleCols<3>(block);
            return innovation.share_of(h * state.covariance.template block<3, 3>(block, block) * h.transpose());
        };
        Mat3<Scalar> translation = share(0);
        Mat3<Scalar> rotation = share(3);
        if (in_frame) {
            const Scalar whole = innovation.share_of(innovation.predicted).trace();
            const Scalar factor = std::min(Scalar(1), whole / (translation.trace() + rotation.trace()));
            translation *= factor;
            rotation *= factor;
        }
        adapt_block(0, state.position_m.squaredNorm(), translation_limits_, translation_, translation);
        adapt_block(3, Scalar(1), rotation_limits_, rotation_, rotation);
    }

    DensityLimits<Scalar> translation_limits_;
    DensityLimits<Scalar> rotation_limits_;
    DensityEstimate<Scalar> translation_;
    DensityEstimate<Scalar> rotation_;
    Scalar consistency_ = 1;
    Scalar outlier_inflation_ = 0;  // of recent columns: squared innovation over its limit, decaying
};

}  // namespace tricoil::tracking::scaat
