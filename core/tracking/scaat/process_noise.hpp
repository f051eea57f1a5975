// Process noise: acceleration intensities, estimated from the innovations.
#pragma once

#include <algorithm>

#include "core/linear/matrix.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking::scaat {

/// The motion model is constant velocity with white acceleration (Bar-Shalom, Li, Kirubarajan 2001, section 6.2.2), around the
/// mean acceleration of learn_acceleration(). The spectral density q is estimated, not set: the output is quiet for a resting
/// hand and has no lag for a fast one.
template <typename Scalar>
struct DensityEstimate {
    Scalar log_q = 0;        // q in m^2/s^3 or rad^2/s^3
    Scalar information = 1;  // Fisher information per column, smoothed
    Scalar score = 0;        // d log likelihood / d log q per column, smoothed
};

/// Limits of log q.
template <typename Scalar>
struct DensityLimits {
    Scalar least;
    Scalar most;
};

/// Stochastic approximation of the maximum-likelihood q (score over Fisher information, as in Mehra 1970, "On the identification
/// of variances and adaptive Kalman filtering"): the innovation y has covariance S = H P H^T + R, of which H P H^T scales with q.
/// share: S^-1/2 (H P H^T) S^-T/2 of one block (position or rotation); whitened: S^-1/2 y.
template <typename Scalar>
void adapt(DensityEstimate<Scalar>& q, const DensityLimits<Scalar>& limits, const Mat3<Scalar>& share,
           const Vec3<Scalar>& whitened, const ProcessNoiseParams<Scalar>& params) {
    const Scalar score = (whitened.dot(share * whitened) - share.trace()) / 2;
    const Scalar fisher = share.squaredNorm() / 2;
    q.information += params.gain * (fisher - q.information);
    q.score += params.smoothing * (score - q.score);
    const Scalar gain = q.score > 0 ? params.gain * params.rise : params.gain;
    const Scalar step = gain * q.score / (q.information + params.information_floor);
    q.log_q = std::clamp(q.log_q + (step > params.largest_step ? params.largest_step : step), limits.least, limits.most);
}

}  // namespace tricoil::tracking::scaat
