// Second time derivative of the couplings, and the error of blur that follows from it.
#pragma once

#include <algorithm>

#include "core/tracking/scaat/state.hpp"

namespace tricoil::tracking::scaat {

/// The paper's example III (15.7 m/s at 0.5 m) reaches half of it.
constexpr double kMaxCurvature_per_s2 = 1e4;

/// Second time derivative of a coupling divided by the coupling strength k (1/s^2): root mean square of the nine entries of (6),
/// from k / rho^3 and the rotation of u and O. All terms are added with positive sign. The result is limited, because the gate
/// allows for a share of the blur: a state with impossible rates would widen the gate without limit.
template <typename Scalar>
Scalar signal_curvature(const State<Scalar>& state) {
    constexpr Scalar kEntry = Scalar(0.41);  // sqrt(3/2) / 3
    const Scalar range = state.position_m.norm();
    const Scalar v = state.velocity_m_s.norm() / range;
    const Scalar w = state.rate_rad_s.norm();
    const Scalar curvature = kEntry * (3 * state.acceleration_m_s2.norm() / range + 12 * v * v + 6 * v * w + w * w +
                                       state.angular_acceleration_rad_s2.norm());
    return std::min(curvature, Scalar(kMaxCurvature_per_s2));
}

/// Error of blur per unit of X'': the mean over a window of length tau is X + X'' tau^2 / 24.
template <typename Scalar>
constexpr Scalar blur_s2(Scalar window_s) {
    return window_s * window_s / 24;
}

}  // namespace tricoil::tracking::scaat
