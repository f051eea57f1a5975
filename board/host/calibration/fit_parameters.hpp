// Vector of the parameters that a calibration estimates, without redundancy.
#pragma once

#include <array>

#include "board/support/calibration_file.hpp"
#include "core/field/general_dipole.hpp"

namespace tricoil::host {

/// Magnetic parameters: moments (6, symmetric, in units of C), sensitivities (5, symmetric with trace three), source offsets (6)
/// and sensor offsets (6, the third coil's is minus the sum), octupoles (3 and 3). Lengths in units of 0.1 m.
constexpr int kMagnetic = 29;
constexpr int kMoments = 0, kSensitivities = 6, kSourceOffsets = 11, kSensorOffsets = 17, kOctupoles = 23;
constexpr double kLengthUnit_m = 0.1;

/// Parameters of StageErrors: turning and room (9 each, row by row), stray (9, row by row, in units of C / m^3).
constexpr int kStage = 27;
constexpr int kTurning = 0, kRoom = 9, kStray = 18;

/// Pick-up (9, column by column), in units of C / m^3.
constexpr int kPickUp = 9;

/// `c`: coupling constant of the start, factor of the stray field.
inline StageErrors stage_errors_of(const double* p, double c) {
    using Rows = Matrix<double, 3, 3, Order::by_rows>;
    const Rows turning(p + kTurning);
    const Rows room(p + kRoom);
    const Rows stray(p + kStray);
    return {turning, room, c * stray};
}

inline Mat3<double> symmetric_matrix(double xx, double yy, double zz, double xy, double xz, double yz) {
    Mat3<double> m;
    m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return m;
}

/// Of six parameters: xx, yy, zz, xy, xz, yz.
inline Mat3<double> symmetric_matrix(const double* p) { return symmetric_matrix(p[0], p[1], p[2], p[3], p[4], p[5]); }

/// Of five parameters: xx, yy, xy, xz, yz. The trace is three.
inline Mat3<double> sensitivity_matrix(const double* p) {
    return symmetric_matrix(p[0], p[1], 3 - p[0] - p[1], p[2], p[3], p[4]);
}

/// Parameters of coils with one centre and these gains and angles, see SelfCalibration.
inline std::array<double, kMagnetic> parameters_of(const Mat3<double>& source, const Mat3<double>& sensor) {
    const Mat3<double>& m = source;
    const Mat3<double>& n = sensor;
    return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2), n(0, 0), n(1, 1), n(0, 1), n(0, 2), n(1, 2)};
}

inline Mat3<double> offsets_with_zero_sum(const double* p) {
    Mat3<double> m;
    m.col(0) << p[0], p[1], p[2];
    m.col(1) << p[3], p[4], p[5];
    m.col(2) = -(m.col(0) + m.col(1));
    return kLengthUnit_m * m;
}

/// Model of parameters `p`. `c`: coupling constant of the start, factor of the moments.
inline field::GeneralDipole<double> model_of(const double* p, double c) {
    field::GeneralDipole<double> model;
    model.source_moment = c * symmetric_matrix(p);
    model.sensor_sensitivity = sensitivity_matrix(p + kSensitivities);
    model.source_offset_m = offsets_with_zero_sum(p + kSourceOffsets);
    model.sensor_offset_m = offsets_with_zero_sum(p + kSensorOffsets);
    for (int i = 0; i < 3; ++i) {
        model.source_octupole_m2(i) = kLengthUnit_m * kLengthUnit_m * p[kOctupoles + i];
        model.sensor_octupole_m2(i) = kLengthUnit_m * kLengthUnit_m * p[kOctupoles + 3 + i];
    }
    return model;
}

}  // namespace tricoil::host
