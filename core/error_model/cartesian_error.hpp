// The paper's angle errors as lengths: Cartesian coordinates of the source frame.
#pragma once

#include "core/geometry/angles.hpp"

namespace tricoil::error_model {

/// True minus measured position (m, source frame), exact for errors of any size.
template <typename Scalar>
Vec3<Scalar> cartesian_error(const geometry::Spherical<Scalar>& real, const geometry::Spherical<Scalar>& error) {
    const geometry::Spherical<Scalar> measured{real.range_m - error.range_m, real.azimuth_rad - error.azimuth_rad,
                                               real.elevation_rad - error.elevation_rad};
    return geometry::to_cartesian(real) - geometry::to_cartesian(measured);
}

/// The same to first order: P^T (e_rho, rho cos(beta) e_alpha, -rho e_beta). Positive elevation points to -z.
template <typename Scalar>
Vec3<Scalar> cartesian_error_first_order(const geometry::Spherical<Scalar>& real, const geometry::Spherical<Scalar>& error) {
    const Vec3<Scalar> tracking(error.range_m, real.range_m * std::cos(real.elevation_rad) * error.azimuth_rad,
                                -real.range_m * error.elevation_rad);
    return geometry::line_of_sight_rotation(real.azimuth_rad, real.elevation_rad).transpose() * tracking;
}

}  // namespace tricoil::error_model
