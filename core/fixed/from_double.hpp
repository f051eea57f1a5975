// Conversions between the types of the integer tracker and types in double, for programs that configure it or show its poses.
#pragma once

#include "core/fixed/tracker.hpp"
#include "core/signal/demodulator.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::fixed {

/// value must be finite; relative error below 2^-31.
Scaled scaled_from(double value);

/// Vector in the direction of v with entries of magnitude at most one half. Zero if v is zero or not finite.
Vec3<Unit> direction_from(const Vec3<double>& v);

/// Converts responses, limits and smoothing. The smoothing weight is rounded to a power of two. Gain steps and the
/// noise floor are not supported. volts_per_code: of the converters.
/// Errors: those of check().
Result<DemodulatorParams> demodulator_params_from(const signal::DemodulatorParams<double>& params, double volts_per_code);

/// Position and attitude are exact; covariance and SNR follow from the noise share. No chi-square: the misfit share is too
/// coarse.
tracking::PoseEstimate<double> to_double(const PoseEstimate& estimate);

}  // namespace tricoil::fixed
