// Gains and non-orthogonality from free motion alone: a dipole field of concentric triads leaves three numbers per frame that
// must be zero, wherever the sensor is and however it is turned.
#pragma once

#include <vector>

#include "core/geometry/types.hpp"

namespace tricoil::host {

struct SelfCalibration {
    /// Symmetric, trace three: X_ideal ~ sensor^-T X source^-1. What is not observable is fixed so: the overall strength (C), and
    /// a rotation of either triad as a whole (absorbed by the frames).
    Mat3<double> sensor = Mat3<double>::Identity();
    Mat3<double> source = Mat3<double>::Identity();
    Mat3<double> sensor_deviation = Mat3<double>::Zero();  // standard deviations of the entries
    Mat3<double> source_deviation = Mat3<double>::Zero();
    double misfit_before = 0;  // root mean square share of a frame's couplings that no dipole explains
    double misfit_after = 0;
    Vec3<double> ratios_before;  // mean singular values over the smallest one's mean
    Vec3<double> ratios_after;
    Vec3<double> spread_before;  // standard deviation of s1 / (s2 + s3), s2 / s3 and their misfit to 1, 1 over the frames
    Vec3<double> spread_after;
    double weakest = 0;  // smallest over largest singular value of the normalised Jacobian: identifiability
    bool converged = false;
};

/// Robust least squares (Cauchy loss) on the misfit of every frame to its nearest dipole matrix, from ideal triads on.
/// Throws InputError: fewer than 30 frames, or motion that leaves a parameter undetermined.
/// prior: weight of the expectation that triads are ideal, against one frame's misfit, per root of the frames. Zero, as for a
/// result: none. A start for something better takes 0.02: what the frames hardly show then stays ideal, and nothing is refused.
SelfCalibration self_calibrate(const std::vector<Mat3<double>>& frames, double prior = 0);

/// X of ideal triads: sensor^-T X source^-1.
Mat3<double> corrected(const Mat3<double>& x, const Mat3<double>& sensor, const Mat3<double>& source);

}  // namespace tricoil::host
