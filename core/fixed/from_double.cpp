#include "core/fixed/from_double.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "core/solver/pose_covariance.hpp"

namespace tricoil::fixed {
namespace {

/// 1 / response, with real and imaginary part of magnitude at most one.
Correction correction_from(std::complex<double> response) {
    const std::complex<double> g = 1.0 / response;
    int exponent = 0;
    (void)std::frexp(std::max(std::abs(g.real()), std::abs(g.imag())), &exponent);
    return {Unit::from(std::ldexp(g.real(), -exponent)), Unit::from(std::ldexp(g.imag(), -exponent)), exponent};
}

std::int32_t nearest(double value) {
    return static_cast<std::int32_t>(std::clamp(std::round(value), -2147483648.0, 2147483647.0));
}

}  // namespace

Scaled scaled_from(double value) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return normalise(std::llround(std::ldexp(mantissa, 62)), exponent - 62);
}

Vec3<Unit> direction_from(const Vec3<double>& v) {
    const double largest = v.cwiseAbs().maxCoeff();
    if (!(largest > 0) || !std::isfinite(largest)) {
        return Vec3<Unit>::Zero();
    }
    return (v / (2 * largest)).unaryExpr([](double entry) { return Unit::from(entry); });
}

Result<DemodulatorParams> demodulator_params_from(const signal::DemodulatorParams<double>& params, double volts_per_code) {
    DemodulatorParams fixed;
    for (std::size_t carrier = 0; carrier < kSourceCoils; ++carrier) {
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            fixed.corrections[carrier][coil] = correction_from(params.response[carrier][coil]);
        }
    }
    fixed.least_reference = static_cast<std::int32_t>(params.min_reference_v / volts_per_code);
    fixed.low_signal_ratio = nearest(params.low_signal_ratio);
    fixed.linear_share = Unit::from(static_cast<double>(params.linear_share));
    fixed.noise_shift = nearest(-std::log2(params.noise_smoothing));
    fixed.noise_jump = nearest(params.noise_jump);
    const Status status = check(fixed);
    return status.ok() ? Result<DemodulatorParams>(fixed) : status;
}

tracking::PoseEstimate<double> to_double(const PoseEstimate& estimate) {
    tracking::PoseEstimate<double> e;
    e.sensor = estimate.sensor;
    e.sequence = estimate.sequence;
    e.time = estimate.time;
    e.state = estimate.state;
    e.flags = estimate.flags;
    e.position_m = estimate.position_m.unaryExpr([](Metres entry) { return entry.to_double(); });
    const Quaternion& q = estimate.q_source_sensor;
    e.q_source_sensor = {q.w.to_double(), q.x.to_double(), q.y.to_double(), q.z.to_double()};
    const double noise = estimate.noise_share.to_double();
    const double range_m = e.position_m.norm();
    if (noise > 0 && range_m > 0) {
        e.covariance = solver::pose_covariance<double>(1, range_m, e.position_m / range_m, noise);
        e.snr_db = -20 * std::log10(noise);
    }
    e.flags.has(tracking::PoseFlag::not_converged) ? clear_position(e) : clear_unknown_position(e);  // without a solution
    return e;
}

}  // namespace tricoil::fixed
