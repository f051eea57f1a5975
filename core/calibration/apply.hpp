// Functions that apply a calibration to signal matrices and positions.
#pragma once

#include <Eigen/LU>
#include <cmath>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

/// Couplings of ideal concentric triads with C = 1: removes gains and coil angles, N^-T X M^-1. Offsets are not removed.
template <typename Scalar>
Mat3<Scalar> ideal_couplings(const Calibration<Scalar>& c, const Mat3<Scalar>& x) {
    const Mat3<Scalar> sensor = c.model.sensor_sensitivity.transpose().inverse();
    const Mat3<Scalar> source = c.model.source_moment.inverse();
    return sensor * x * source;
}

/// Optional output correction: an affine map that removes position errors that the field model cannot describe.
template <typename Scalar>
Vec3<Scalar> corrected_position(const Calibration<Scalar>& c, const Vec3<Scalar>& position_m) {
    return c.output_linear * position_m + c.output_offset_m;
}

}  // namespace tricoil::calibration
