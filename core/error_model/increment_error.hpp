// Measured increments of one update and their errors: (28)-(36), and the exact expressions that they approximate. The attitude is
// constant.
#pragma once

#include <cmath>

#include "core/error_model/kappa.hpp"
#include "core/error_model/line_of_sight_step.hpp"

namespace tricoil::error_model {

/// Measured increment of elevation, Delta beta~. Exact: (2 / kappa) cos(g) (sin db + cos b sin b^ (1 - cos da)), from (16), (17)
/// with the exact R. (28) is its expansion; (32) is (28) with kappa = 2.
template <typename Scalar>
Scalar measured_elevation_increment(KappaForm form, const LineOfSightStep<Scalar>& step) {
    const Scalar da = step.d_azimuth_rad;
    const Scalar db = step.d_elevation_rad;
    if (form == KappaForm::exact) {
        // 1 - cos(da) is computed as 2 sin^2(da / 2) to avoid cancellation for small steps.
        const Scalar half = std::sin(da / 2);
        const Scalar out_of_plane = std::cos(step.end_elevation_rad()) * std::sin(step.elevation_rad) * 2 * half * half;
        return (2 / kappa_exact(step)) * cosine_of_turn(step) * (std::sin(db) + out_of_plane);
    }
    const Scalar sine = std::sin(da);
    return (std::sin(2 * db) * std::cos(da) + std::sin(2 * step.elevation_rad) * sine * sine / 2) / kappa(form, step);
}

/// Measured increment of azimuth, Delta alpha~. Exact: (2 / kappa) cos(g) cos(b) sin(da) / cos(b^measured). The divisor comes
/// from (17); the device uses its estimate of the elevation, beta_1 - e_beta. This is the error propagation of (34)-(36).
template <typename Scalar>
Scalar measured_azimuth_increment(KappaForm form, const LineOfSightStep<Scalar>& step, Scalar measured_elevation_rad) {
    const Scalar divisor = std::cos(measured_elevation_rad);
    const Scalar sine = std::sin(step.d_azimuth_rad);
    if (form == KappaForm::exact) {
        return (2 / kappa_exact(step)) * cosine_of_turn(step) * std::cos(step.end_elevation_rad()) * sine / divisor;
    }
    return (2 / kappa(form, step)) * sine * std::cos(step.d_elevation_rad) * std::cos(step.elevation_rad) / divisor;
}

/// e_Delta_beta (20): (28) times the update time, (32) for kappa = 2.
template <typename Scalar>
Scalar elevation_increment_error(KappaForm form, const LineOfSightStep<Scalar>& step) {
    return step.d_elevation_rad - measured_elevation_increment(form, step);
}

}  // namespace tricoil::error_model
