// How restless the sensor is: acceleration intensities that follow the innovations.
#pragma once

#include "core/geometry/types.hpp"

namespace tricoil::tracking::scaat {

/// The motion model is constant velocity with white acceleration (Bar-Shalom, Li, Kirubarajan 2001, section 6.2.2), about the
/// mean one that learn_acceleration() follows. Its spectral density q is estimated, not set: a resting hand gets a quiet output
/// and a fast one no lag. Limits come from what hands do: 0.1 m/s^2 for 0.1 s is a resting hand, 2,000 m/s^2 for 25 ms the
/// paper's example III. Gain, rise and smoothing were chosen on recorded hand motions (tests/bench/tracking_table): errors are
/// flat within 2 % around them, and the same on the half of the files that was not looked at; they trade quiet at rest against
/// honesty in motion.
template <typename Scalar>
struct ProcessNoiseParams {
    Scalar least_m2_s3 = Scalar(1e-3);       // translation, m^2/s^3
    Scalar most_m2_s3 = Scalar(1e5);         //
    Scalar start_m2_s3 = 1;                  // while nothing is known: 4.5 m/s^2 for 50 ms
    Scalar least_rad2_s3 = Scalar(0.3);      // rotation, rad^2/s^3
    Scalar most_rad2_s3 = Scalar(1e6);       //
    Scalar start_rad2_s3 = 30;               // 25 rad/s^2 for 50 ms
    Scalar gain = Scalar(1) / 20;            // weight of one column: 20 columns are 28 ms of 240 Hz TDM frames
    Scalar rise = Scalar(1.8);               // times the gain upwards: too low a q lags and lies, too high a one is only noisier
    Scalar smoothing = Scalar(0.35);         // weight of one column's score: at rest single scores are mostly noise
    Scalar information_floor = Scalar(0.2);  // Fisher information per column below which the gain fades: noise hides the motion
    Scalar largest_step = 2;                 // of log q per column: an outlier must not open the filter at once
};

template <typename Scalar>
struct ProcessNoiseState {
    Scalar log_translation = 0;          // of m^2/s^3
    Scalar log_rotation = 0;             // of rad^2/s^3
    Scalar information_translation = 1;  // Fisher information per column, smoothed
    Scalar information_rotation = 1;
    Scalar score_translation = 0;  // d log likelihood / d log q per column, smoothed
    Scalar score_rotation = 0;
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
