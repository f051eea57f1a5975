// Coupling between a concentric source triad and a concentric sensor triad in the dipole near field, (3)-(6).
#pragma once

#include "core/geometry/rotations.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::field {

/// C of (3), coupling units times m^3.
template <typename Scalar>
using CouplingConstant = Scalar;

/// D(u) = P^T S P = 3/2 u u^T - 1/2 I of (6): directional factor of the dipole field. u: unit vector to the sensor.
template <typename Scalar>
Mat3<Scalar> dipole_factor(const Vec3<Scalar>& u) {
    return Scalar(1.5) * u * u.transpose() - Scalar(0.5) * Mat3<Scalar>::Identity();
}

/// k = C / rho^3, the coupling along the line of sight.
template <typename Scalar>
Scalar coupling_strength(CouplingConstant<Scalar> c, Scalar range_m) {
    return c / (range_m * range_m * range_m);
}

/// X = (C / rho^3) O D(u) of (6); X(i, j) = output of sensor coil i, row M_i of (7), while source coil j is excited.
/// position_m: sensor in the source frame, not zero; o: source components to sensor components.
template <typename Scalar>
Mat3<Scalar> signal_matrix(CouplingConstant<Scalar> c, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    const Scalar range = position_m.norm();
    return coupling_strength(c, range) * o * dipole_factor<Scalar>(position_m / range);
}

/// One column of X and its derivatives with respect to (position, small rotation), both in the source frame.
template <typename Scalar>
struct ColumnModel {
    Vec3<Scalar> column;                       // coupling units
    Matrix<Scalar, 3, 3> by_position_per_m;    // d column / d position
    Matrix<Scalar, 3, 3> by_rotation_per_rad;  // d column / d r, attitude q -> exp(r) q
};

/// Column j (0-2) of (6) with its analytic Jacobian. From B = C (3 (u.m) u - m) / (2 rho^3), m = e_j.
template <typename Scalar>
ColumnModel<Scalar> column_model(CouplingConstant<Scalar> c, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o, int j) {
    const Scalar range = position_m.norm();
    const Vec3<Scalar> u = position_m / range;
    const Scalar k = coupling_strength(c, range);
    const Scalar along = Scalar(1.5) * k * u(j);
    const Scalar against = Scalar(0.5) * k;
    Vec3<Scalar> b = along * u;
    b(j) -= against;
    // O B and O dB/dp with dB/dp = (3k / 2 rho) (u m^T + m u^T + (u.m) (I - 5 u u^T)), from O u and O m alone.
    const Vec3<Scalar> ou = o * u;
    const Scalar slope = Scalar(1.5) * k / range;
    const Vec3<Scalar> across = slope * (o.col(j) - (5 * u(j)) * ou);
    ColumnModel<Scalar> model;
    model.column = along * ou - against * o.col(j);
    model.by_position_per_m = (slope * u(j)) * o + across * u.transpose();
    model.by_position_per_m.col(j) += slope * ou;
    // O -> O exp(-[r]x), so d(O B) = -O (r x B) = O [B]x r.
    model.by_rotation_per_rad = geometry::times_skew<Scalar>(o, b);
    return model;
}

/// Jacobian of vec(X), in column order, with respect to (position, small rotation), source frame: 9 x 6.
template <typename Scalar>
Matrix<Scalar, 9, 6> signal_matrix_jacobian(CouplingConstant<Scalar> c, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    Matrix<Scalar, 9, 6> jacobian;
    for (int j = 0; j < 3; ++j) {
        const ColumnModel<Scalar> model = column_model(c, position_m, o, j);
        jacobian.template block<3, 3>(3 * j, 0) = model.by_position_per_m;
        jacobian.template block<3, 3>(3 * j, 3) = model.by_rotation_per_rad;
    }
    return jacobian;
}

}  // namespace tricoil::field
