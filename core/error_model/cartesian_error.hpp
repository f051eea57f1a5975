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

}  // namespace tricoil::error_model
