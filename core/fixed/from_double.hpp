// Conversions between the integer tracker's types and those in double: for programs that set it up or show its poses.
#pragma once

#include "core/fixed/tracker.hpp"
#include "core/signal/demodulator.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::fixed {

/// value must be finite; relative error below 2^-31.
Scaled scaled_from(double value);

/// A vector of that direction with entries of at most one half; zero of one that is zero or not finite.
Vec3<Unit> direction_from(const Vec3<double>& v);

/// Responses, limits and smoothing; the smoothing's weight becomes the nearest power of two. Gain steps and the noise floor have
/// no counterpart. volts_per_code: of the converters. Errors: those of check().
Result<DemodulatorParams> demodulator_params_from(const signal::DemodulatorParams<double>& params, double volts_per_code);

/// Position and attitude exactly; covariance and SNR from the noise share. No chi-square: the misfit share is too coarse for it.
tracking::PoseEstimate<double> to_double(const PoseEstimate& estimate);

}  // namespace tricoil::fixed
