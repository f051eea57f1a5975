// Error of one azimuth increment, from the measured increment of the product.
#pragma once

#include "core/error_model/increment_error.hpp"

namespace tricoil::error_model {

/// e_Delta_alpha (25), (36). elevation_error_rad: e_beta, the elevation error of the device's estimate in the divisor.
inline double azimuth_increment_error(KappaForm form, const LineOfSightStep<double>& step, double elevation_error_rad) {
    return step.d_azimuth_rad - measured_azimuth_increment(form, step, step.elevation_rad - elevation_error_rad);
}

}  // namespace tricoil::error_model
