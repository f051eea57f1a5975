// Process noise: acceleration intensities, estimated from the innovations.
#pragma once

#include <cmath>

#include "core/linear/matrix.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking::scaat {

/// The motion model is constant velocity with white acceleration (Bar-Shalom, Li, Kirubarajan 2001, section 6.2.2), around the
/// mean acceleration of learn_acceleration(). The spectral density q is estimated, not set: the output is quiet for a resting
/// hand and has no lag for a fast one.
template <typename Scalar>
struct ProcessNoiseState {
    Scalar log_translation = 0;          // of m^2/s^3
    Scalar log_rotation = 0;             // of rad^2/s^3
    Scalar information_translation = 1;  // Fisher information per column, smoothed
    Scalar information_rotation = 1;
    Scalar score_translation = 0;  // d log likelihood / d log q per column, smoothed
    Scalar score_rotation = 0;
};

/// Limits of the logarithms, computed once.
template <typename Scalar>
struct ProcessNoiseLimits {
    explicit ProcessNoiseLimits(const ProcessNoiseParams<Scalar>& params)
        : least_log_translation(std::log(params.least_m2_s3)),
          most_log_translation(std::log(params.most_m2_s3)),
          least_log_rotation(std::log(params.least_rad2_s3)),
          most_log_rotation(std::log(params.most_rad2_s3)) {}

    Scalar least_log_translation;
    Scalar most_log_translation;
    Scalar least_log_rotation;
    Scalar most_log_rotation;
};

/// Stochastic approximation of the maximum-likelihood q (score over Fisher information, as in Mehra 1970, "On the identification
/// of variances and adaptive Kalman filtering"): the innovation y has covariance S = H P H^T + R, of which H P H^T scales with q.
/// share: S^-1/2 (H P H^T) S^-T/2 of one block (position or rotation); whitened: S^-1/2 y. Returns the new log q.
template <typename Scalar>
Scalar adapted_log(Scalar log_q, Scalar& information, Scalar& smoothed, const Mat3<Scalar>& share, const Vec3<Scalar>& whitened,
                   const ProcessNoiseParams<Scalar>& params) {
    const Scalar score = (whitened.dot(share * whitened) - share.trace()) / 2;
    const Scalar fisher = share.squaredNorm() / 2;
    information += params.gain * (fisher - information);
    smoothed += params.smoothing * (score - smoothed);
    const Scalar gain = smoothed > 0 ? params.gain * params.rise : params.gain;
    const Scalar step = gain * smoothed / (information + params.information_floor);
    return log_q + (step > params.largest_step ? params.largest_step : step);
}

}  // namespace tricoil::tracking::scaat
