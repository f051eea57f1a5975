// Estimates gains and non-orthogonality from free motion: for concentric triads in a dipole field, three numbers per column frame
// are zero at every pose.
#pragma once

#include <cmath>
#include <vector>

#include "core/field/concentric_dipole.hpp"
#include "core/linear/matrix.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::host {

struct SelfCalibration {
    /// Symmetric, trace three: X_ideal ~ sensor^-T X source^-1. This convention fixes the unobservable parameters: overall
    /// strength (C) and a rotation of each triad (part of its coordinate frame).
    Mat3<double> sensor = Mat3<double>::Identity();
    Mat3<double> source = Mat3<double>::Identity();
    Mat3<double> sensor_deviation = Mat3<double>::Zero();  // standard deviations of the entries
    Mat3<double> source_deviation = Mat3<double>::Zero();
    /// Standard deviation of a coupling that these cause, relative to k. A column of O D has a mean square of 1/2; the errors lie
    /// more in the directions of poses than independent ones (1.5 times the variance: tests/calibration/coil_errors_test).
    [[nodiscard]] double coupling_error() const {
        return std::sqrt(1.5 * 0.5 / 9) * std::hypot(sensor_deviation.norm(), source_deviation.norm());
    }
    double misfit_before = 0;  // RMS share of the couplings that no dipole explains
    double misfit_after = 0;
    Vec3<double> ratios_before;  // mean singular values divided by the mean of the smallest
    Vec3<double> ratios_after;
    Vec3<double> spread_before;  // standard deviations of s1 / (s2 + s3) and s2 / s3; RMS misfit share
    Vec3<double> spread_after;
    double weakest = 0;  // smallest over largest singular value of the Jacobian: identifiability
    bool converged = false;
};

/// Robust least squares (Cauchy loss) on the misfit of every column frame to its nearest dipole matrix, starting from ideal
/// triads. Throws InputError for fewer than 30 column frames, or motion that does not determine all parameters.
SelfCalibration self_calibrate(const std::vector<Mat3<double>>& frames);

/// X of ideal triads: sensor^-T X source^-1. Removes gains and coil angles, not offsets.
inline Mat3<double> corrected(const Mat3<double>& x, const Mat3<double>& sensor, const Mat3<double>& source) {
    return sensor.transpose().inverse() * x * source.inverse();
}

/// (X - nearest dipole matrix) / coupling strength, of couplings of ideal triads. `nearest`: their direct solution.
inline Mat3<double> misfit_of(const Mat3<double>& ideal, const solver::DirectSolution<double>& nearest) {
    return ideal / nearest.strength - nearest.attitude * field::dipole_factor<double>(nearest.direction);
}

}  // namespace tricoil::host
