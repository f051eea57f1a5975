// Functions that apply a calibration to couplings and positions.
#pragma once

#include <Eigen/LU>
#include <cmath>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

/// Real couplings of one column: the part of (in phase, quadrature) along the phase of each channel.
template <typename Scalar>
Vec3<Scalar> at_phase(const Calibration<Scalar>& c, const Vec3<Scalar>& in_phase, const Vec3<Scalar>& quadrature) {
    return c.phase_rad.array().cos() * in_phase.array() + c.phase_rad.array().sin() * quadrature.array();
}

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
