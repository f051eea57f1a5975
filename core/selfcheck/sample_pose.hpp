// Pose of the known answers, with its signal matrix.
#pragma once

#include "core/selfcheck/known_answer.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::selfcheck {

constexpr double kSampleCoupling = 0.7;  // C

template <typename Scalar>
solver::AnglePose<Scalar> sample_pose() {
    return {{Scalar(0.6), Scalar(0.8), Scalar(0.35)}, {Scalar(0.4), Scalar(-0.6), Scalar(1.1)}};
}

/// X of (6) at sample_pose().
inline Mat3<double> sample_signal_matrix() {
    return known<3, 3>(0.42410047266016498, 1.1841703592648558, -1.7825025788707596, -0.62243858725698697, -2.068320641486693,
                       -0.32229000124477081, -2.3306991757229598, -0.72263112207528812, 0.52015327219589769);
}

/// Six different numbers that reduce a matrix to a vector.
inline Vec6<double> sample_weights() { return known<6, 1>(0.3, -0.2, 0.5, -0.4, 0.25, 0.1); }

}  // namespace tricoil::selfcheck
