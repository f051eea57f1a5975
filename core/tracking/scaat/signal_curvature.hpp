// How fast the couplings bend: what extrapolation leaves of them, and what a window blurs.
#pragma once

#include "core/tracking/scaat/state.hpp"

namespace tricoil::tracking::scaat {

/// Second time derivative of a coupling over the coupling strength k (1/s^2): root mean square of the nine entries of (6), from
/// k / rho^3 and the turning of u and O. Signs are left out: metal that does less cannot be told from motion.
template <typename Scalar>
Scalar signal_curvature(const State<Scalar>& state) {
    constexpr Scalar kEntry = Scalar(0.41);  // sqrt(3/2) / 3
    const Scalar range = state.position_m.norm();
    const Scalar v = state.velocity_m_s.norm() / range;
    const Scalar w = state.rate_rad_s.norm();
    return kEntry * (3 * state.acceleration_m_s2.norm() / range + 12 * v * v + 6 * v * w + w * w +
                     state.angular_acceleration_rad_s2.norm());
}

/// What deskewing leaves of a coupling, per unit of X'': linear extrapolation by a share a of the frame T errs by
/// (a + a^2) T^2 X''/2, at most with a = 2/3. span_s: longest time between three columns, 2.5 slots.
template <typename Scalar>
constexpr Scalar deskew_remainder_s2(Scalar span_s) {
    constexpr Scalar kShare = Scalar(2) / 3;
    const Scalar frame_s = Scalar(1.2) * span_s;
    return (kShare + kShare * kShare) / 2 * frame_s * frame_s;
}

/// What a window does to a coupling, per unit of X'': a boxcar of length tau reads X + X'' tau^2 / 24 (physics 6).
template <typename Scalar>
constexpr Scalar blur_s2(Scalar window_s) {
    return window_s * window_s / 24;
}

}  // namespace tricoil::tracking::scaat
