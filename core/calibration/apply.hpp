// Applying a calibration to couplings and positions.
#pragma once

#include <Eigen/LU>
#include <cmath>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

/// One column's real couplings from both phases: the part along each channel's own phase.
template <typename Scalar>
Vec3<Scalar> at_phase(const Calibration<Scalar>& c, const Vec3<Scalar>& in_phase, const Vec3<Scalar>& quadrature) {
    return c.phase_rad.array().cos() * in_phase.array() + c.phase_rad.array().sin() * quadrature.array();
}

/// What ideal triads in one place would couple with C = 1: gains and angles undone, N^-T X M^-1. Offsets remain.
template <typename Scalar>
Mat3<Scalar> ideal_couplings(const Calibration<Scalar>& c, const Mat3<Scalar>& x) {
    const Mat3<Scalar> sensor = c.model.sensor_sensitivity.transpose().inverse();
    const Mat3<Scalar> source = c.model.source_moment.inverse();
    return sensor * x * source;
}

/// The optional output correction: what the field model leaves of the surroundings, as an affine map.
template <typename Scalar>
Vec3<Scalar> corrected_position(const Calibration<Scalar>& c, const Vec3<Scalar>& position_m) {
    return c.output_linear * position_m + c.output_offset_m;
}

}  // namespace tricoil::calibration
