// Calibration parameters of the coils.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/base/status.hpp"
#include "core/field/general_dipole.hpp"
#include "core/linear/quaternion.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::calibration {

/// Pick-up: the part of the couplings that does not come from the sensor (common ground, wires of the source beside those of the
/// sensor). It is constant, and stated as it is measured, before phase_rad; (i, j): sensor channel i, source coil j. The
/// default is none.
template <typename Scalar>
struct PickUp {
    Mat3<Scalar> in_phase = Mat3<Scalar>::Zero();
    Mat3<Scalar> quadrature = Mat3<Scalar>::Zero();
    Scalar sigma = 0;  // standard deviation of each number

    /// Subtracts it from column j (0-2).
    void remove(int j, Vec3<Scalar>& column_in_phase, Vec3<Scalar>& column_quadrature) const {
        column_in_phase -= in_phase.col(j);
        column_quadrature -= quadrature.col(j);
    }
    [[nodiscard]] bool is_within(Scalar largest) const {
        return in_phase.isZero(largest) && quadrature.isZero(largest) && sigma >= 0 && sigma <= largest;
    }
    [[nodiscard]] bool is_none() const { return in_phase.isZero(0) && quadrature.isZero(0) && sigma == Scalar(0); }

    template <typename Other>
    [[nodiscard]] PickUp<Other> cast() const {
        return {in_phase.template cast<Other>(), quadrature.template cast<Other>(), static_cast<Other>(sigma)};
    }
};

/// Standard deviations of the calibration's own errors. They are constant from pose to pose.
template <typename Scalar>
struct CoilErrors {
    // A file with more is refused.
    static constexpr Scalar kMostOfConstant = Scalar(0.5);
    static constexpr Scalar kMostOfCouplings = Scalar(0.1);
    static constexpr Scalar kMostOfFloor = 10;
    /// The nearest ones that are permitted.
    static CoilErrors within_limits(Scalar coupling_constant, Scalar couplings) {
        return {std::min(coupling_constant, kMostOfConstant), std::min(couplings, kMostOfCouplings)};
    }
    [[nodiscard]] bool is_permitted() const {
        return coupling_constant >= 0 && coupling_constant <= kMostOfConstant && couplings >= 0 &&
               couplings <= kMostOfCouplings && floor_share > 0 && floor_share <= kMostOfFloor;
    }

    Scalar coupling_constant = 0;  // of C, relative
    Scalar couplings = 0;          // of each coupling, relative to k: all other errors of the parameters
    Scalar floor_share = 1;  // of the misfit floor: error of the model in the directions of the couplings that a pose explains

    [[nodiscard]] bool is_none() const {
        return coupling_constant == Scalar(0) && couplings == Scalar(0) && floor_share == Scalar(1);
    }
    template <typename Other>
    [[nodiscard]] CoilErrors<Other> cast() const {
        return {static_cast<Other>(coupling_constant), static_cast<Other>(couplings), static_cast<Other>(floor_share)};
    }
};

/// Low couplings without metal. Only in double, because only programs run trackers for two bands. The default leaves columns
/// unchanged.
template <typename Scalar>
struct LowBand {};
template <>
struct LowBand<double> {
    Mat3<double> ratio = Mat3<double>::Ones();      // (i, j): low coupling / high coupling, as the phases of the high band
    Mat3<double> phase_rad = Mat3<double>::Zero();  // (i, j): of sensor channel i at the low carrier of source coil j
    double quadrature_floor = 1;                    // uncertainty of phase_rad as a quadrature, per coupling; 1: unknown
    /// (j, i): quadrature of the high coupling to source coil i over the rate of that to source coil j, both corrected for the
    /// coils, at the carriers and the frame rate of the calibration. Zero: unknown.
    Mat3<double> motion_lag_s = Mat3<double>::Zero();
    PickUp<double> pick_up;
};

/// Quadratures of the surroundings. Only in double, because images do not judge quadratures.
template <typename Scalar>
struct SurroundingsLag {};
template <>
struct SurroundingsLag<double> {
    field::InducedDipoles<double> dipoles;  // as model.surroundings, at other places; empty: unknown
    double deviation = 0;                   // standard deviation of their ratio to the measured ones while nothing moves
};

template <typename Scalar>
struct Calibration {
    field::GeneralDipole<Scalar> model;                     // moments and sensitivities hold gains and non-orthogonality
    Mat3<Scalar> phase_rad = Mat3<Scalar>::Zero();          // (i, j): of sensor channel i at the carrier of source coil j
    Vec3<Scalar> hemisphere = Vec3<Scalar>::Zero();         // half space of the calibration poses; zero: unknown
    Mat3<Scalar> output_linear = Mat3<Scalar>::Identity();  // corrected position = linear * position + offset, source frame
    Vec3<Scalar> output_offset_m = Vec3<Scalar>::Zero();
    Scalar misfit_floor = 0;             // misfit of clean couplings per coupling, relative to k: errors of the model
    Scalar quadrature_floor = 1;         // quadrature of clean couplings after phase_rad, likewise; 1: unknown
    signal::ConverterErrors converters;  // of the board that measured the couplings
    PickUp<Scalar> pick_up;
    CoilErrors<Scalar> errors;
    [[no_unique_address]] LowBand<Scalar> low_band;
    [[no_unique_address]] SurroundingsLag<Scalar> surroundings_lag;

    template <typename Other>
    [[nodiscard]] Calibration<Other> cast() const {  // without the parts only in double
        return {model.template cast<Other>(),
                phase_rad.template cast<Other>(),
                hemisphere.template cast<Other>(),
                output_linear.template cast<Other>(),
                output_offset_m.template cast<Other>(),
                static_cast<Other>(misfit_floor),
                static_cast<Other>(quadrature_floor),
                converters,
                pick_up.template cast<Other>(),
                errors.template cast<Other>(),
                {},
                {}};
    }
};

/// Virtual dipoles of the surroundings. Errors: those of check() of a calibration.
template <typename Scalar>
Status check(const field::InducedDipoles<Scalar>& surroundings, const Mat3<Scalar>& source_offset_m) {
    constexpr Scalar kNearest_m = Scalar(0.01);
    constexpr Scalar kFarthest_m = 100;
    for (const field::InducedDipole<Scalar>& dipole : surroundings) {
        if (!dipole.position_m.allFinite() || !dipole.moment.allFinite()) {
            return {StatusCode::not_finite, "calibration contains NaN or infinity"};
        }
        const Scalar distance_m = (source_offset_m.colwise() - dipole.position_m).colwise().norm().minCoeff();
        if (distance_m < kNearest_m || dipole.position_m.norm() > kFarthest_m) {
            return {StatusCode::invalid_argument, "calibration: metal of the surroundings is at the source or beyond 100 m"};
        }
    }
    return {};
}

/// Errors: not_finite (NaN or infinity), invalid_argument (linearly dependent moments or sensitivities, an offset beyond 1 m, an
/// output correction or a misfit floor beyond 0.1, a quadrature floor beyond 1, a ratio of the bands beyond 0.5 to 2, a phase of
/// the low band that is not finite, a lag by motion beyond 5 ms, pick-up beyond the couplings at 0.2 m, a virtual dipole at a
/// source coil or beyond 100 m, a deviation of the surroundings' quadrature beyond 1, one of C beyond 0.5 or of a coupling beyond
/// 0.1, a share of the misfit floor beyond 10).
template <typename Scalar>
Status check(const Calibration<Scalar>& c) {
    const bool finite =
        c.model.source_moment.allFinite() && c.model.sensor_sensitivity.allFinite() && c.model.source_offset_m.allFinite() &&
        c.model.sensor_offset_m.allFinite() && c.model.source_octupole_m2.allFinite() && c.model.sensor_octupole_m2.allFinite() &&
        c.phase_rad.allFinite() && c.hemisphere.allFinite() && c.output_linear.allFinite() && c.output_offset_m.allFinite();
    if (!finite) {
        return {StatusCode::not_finite, "calibration contains NaN or infinity"};
    }
    const auto independent = [](const Mat3<Scalar>& m) {
        return std::abs(m.determinant()) > Scalar(1e-3) * m.col(0).norm() * m.col(1).norm() * m.col(2).norm();
    };
    if (!independent(c.model.source_moment) || !independent(c.model.sensor_sensitivity)) {
        return {StatusCode::invalid_argument, "calibration: moments or sensitivities are linearly dependent"};
    }
    if (c.model.source_offset_m.cwiseAbs().maxCoeff() > 1 || c.model.sensor_offset_m.cwiseAbs().maxCoeff() > 1) {
        return {StatusCode::invalid_argument, "calibration: a coil offset exceeds 1 m; offsets are in metres"};
    }
    if ((c.output_linear - Mat3<Scalar>::Identity()).cwiseAbs().maxCoeff() > Scalar(0.1)) {
        return {StatusCode::invalid_argument, "calibration: the output correction exceeds 10 %"};
    }
    if (!(c.misfit_floor >= 0 && c.misfit_floor <= Scalar(0.1))) {
        return {StatusCode::invalid_argument, "calibration: the misfit floor must be a share of 0 to 0.1"};
    }
    if (!(c.quadrature_floor >= 0 && c.quadrature_floor <= 1)) {
        return {StatusCode::invalid_argument, "calibration: the quadrature floor must be a share of 0 to 1"};
    }
    if (!c.errors.is_permitted()) {
        return {
            StatusCode::invalid_argument,
            "calibration: errors are standard deviations, of the coupling constant 0 to 0.5, of couplings 0 to 0.1; the share "
            "of the misfit floor is more than 0, at most 10"};
    }
    const Status bad_pick_up{StatusCode::invalid_argument,
                             "calibration: the pick-up must be smaller than the couplings at 0.2 m"};
    const Scalar largest = 125 * c.model.source_moment.norm();
    if (!c.pick_up.is_within(largest)) {
        return bad_pick_up;
    }
    if constexpr (std::is_same_v<Scalar, double>) {
        if (!c.low_band.ratio.all([](double ratio) { return ratio >= 0.5 && ratio <= 2; })) {
            return {StatusCode::invalid_argument, "calibration: the ratio of the low to the high band must be 0.5 to 2"};
        }
        if (!c.low_band.phase_rad.allFinite() || !(c.low_band.quadrature_floor >= 0 && c.low_band.quadrature_floor <= 1)) {
            return {StatusCode::invalid_argument,
                    "calibration: phases of the low band must be finite, their quadrature floor a share of 0 to 1"};
        }
        if (!c.low_band.pick_up.is_within(largest)) {
            return bad_pick_up;
        }
        if (!c.low_band.motion_lag_s.isZero(5e-3)) {
            return {StatusCode::invalid_argument, "calibration: the lag by motion must be -0.005 to 0.005 s"};
        }
        if (const Status status = check(c.surroundings_lag.dipoles, c.model.source_offset_m); !status.ok()) {
            return status;
        }
        if (!(c.surroundings_lag.deviation >= 0 && c.surroundings_lag.deviation <= 1)) {
            return {StatusCode::invalid_argument, "calibration: the deviation of the surroundings' quadrature must be 0 to 1"};
        }
    }
    return check(c.model.surroundings, c.model.source_offset_m);
}

}  // namespace tricoil::calibration
