// Second time derivative of the couplings, and the errors of deskew and blur that follow from it.
#pragma once

#include "core/tracking/scaat/state.hpp"

namespace tricoil::tracking::scaat {

/// Second time derivative of a coupling divided by the coupling strength k (1/s^2): root mean square of the nine entries of (6),
/// from k / rho^3 and the rotation of u and O. All terms are added with positive sign: metal effects smaller than this cannot be
/// distinguished from motion.
template <typename Scalar>
Scalar signal_curvature(const State<Scalar>& state) {
    constexpr Scalar kEntry = Scalar(0.41);  // sqrt(3/2) / 3
    const Scalar range = state.position_m.norm();
    const Scalar v = state.velocity_m_s.norm() / range;
    const Scalar w = state.rate_rad_s.norm();
    return kEntry * (3 * state.acceleration_m_s2.norm() / range + 12 * v * v + 6 * v * w + w * w +
                     state.angular_acceleration_rad_s2.norm());
}

/// Error of deskew per unit of X'': linear extrapolation by a share a of the frame T has the error (a + a^2) T^2 X''/2, largest
/// at a = 2/3. span_s: longest time between three columns, 2.5 slots.
template <typename Scalar>
constexpr Scalar deskew_remainder_s2(Scalar span_s) {
    constexpr Scalar kShare = Scalar(2) / 3;
    const Scalar frame_s = Scalar(1.2) * span_s;
    return (kShare + kShare * kShare) / 2 * frame_s * frame_s;
}

/// Error of blur per unit of X'': the mean over a window of length tau is X + X'' tau^2 / 24.
template <typename Scalar>
constexpr Scalar blur_s2(Scalar window_s) {
    return window_s * window_s / 24;
}

}  // namespace tricoil::tracking::scaat
