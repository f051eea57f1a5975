// General model: coupling of two triads whose coils each have their own position, direction, strength and optionally finite size.
#pragma once

#include "core/field/coil_pair.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/field/induced_dipole.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::field {

/// X(i, j) = n_i^T O B_j(p + O^T s_i - l_j), B_j(r) = (3 (u.m_j) u - m_j) / (2 |r|^3), u = r / |r|.
/// The factor 1/2 is that of (4). With m_j = C e_j, n_i = e_i and no offsets this is the concentric model (6) with the same C.
///
/// Finite coils: a coil symmetric about its axis and its centre has no quadrupole. Its next term is the axial octupole. It adds
/// lambda (axis.grad)^2 to the field (source) or to the sensitivity (sensor). For a one-layer coil lambda = length^2/24 -
/// radius^2/8: the mean of a harmonic field over its turns. The term falls by (size / range)^2 relative to the dipole. A core or
/// a square former changes only lambda: fourfold symmetry allows no other octupole.
template <typename Scalar>
struct GeneralDipole {
    Mat3<Scalar> source_offset_m = Mat3<Scalar>::Zero();         // column j: l_j, source frame
    Mat3<Scalar> source_moment = Mat3<Scalar>::Identity();       // column j: m_j, source frame, coupling units times m^3
    Mat3<Scalar> sensor_offset_m = Mat3<Scalar>::Zero();         // column i: s_i, sensor frame
    Mat3<Scalar> sensor_sensitivity = Mat3<Scalar>::Identity();  // column i: n_i, sensor frame, no unit
    Vec3<Scalar> source_octupole_m2 = Vec3<Scalar>::Zero();      // lambda of source coil j
    Vec3<Scalar> sensor_octupole_m2 = Vec3<Scalar>::Zero();      // lambda of sensor coil i
    InducedDipoles<Scalar> surroundings;                         // metal at rest; each dipole adds its own coupling

    /// Concentric model (6) with coupling constant C.
    static GeneralDipole concentric(CouplingConstant<Scalar> c) {
        GeneralDipole model;
        model.source_moment = c * Mat3<Scalar>::Identity();
        return model;
    }

    template <typename Other>
    [[nodiscard]] GeneralDipole<Other> cast() const {
        return {source_offset_m.template cast<Other>(),    source_moment.template cast<Other>(),
                sensor_offset_m.template cast<Other>(),    sensor_sensitivity.template cast<Other>(),
                source_octupole_m2.template cast<Other>(), sensor_octupole_m2.template cast<Other>(),
                cast_dipoles<Other>(surroundings)};
    }
};

/// Contribution of the finite sizes of both coils, to be added to dipole_pair(); zero for point-like coils. Same arguments.
template <typename Scalar>
PairCoupling<Scalar> octupole_correction(const Vec3<Scalar>& r_m, const Vec3<Scalar>& moment, const Vec3<Scalar>& sensitivity,
                                         Scalar source_m2, Scalar sensor_m2) {
    PairCoupling<Scalar> sum{Scalar(0), Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()};
    if (source_m2 != Scalar(0)) {
        const Scalar size = moment.norm();
        const Vec3<Scalar> axis = moment / size;
        const auto term = octupole_pair<Scalar>(r_m, axis, sensitivity);
        sum.value += source_m2 * size * term.value;
        sum.by_displacement_per_m += source_m2 * size * term.by_displacement_per_m;
        sum.by_sensitivity += source_m2 * size * term.by_sensitivity;
    }
    if (sensor_m2 != Scalar(0)) {  // reciprocity: exchange the coils; the derivatives are of even order, so signs stay
        const Scalar size = sensitivity.norm();
        const Vec3<Scalar> axis = sensitivity / size;
        const auto term = octupole_pair<Scalar>(r_m, axis, moment);
        sum.value += sensor_m2 * size * term.value;
        sum.by_displacement_per_m += sensor_m2 * size * term.by_displacement_per_m;
        sum.by_sensitivity += sensor_m2 * term.by_axis;
    }
    return sum;
}

/// Dipole of metal with a polarisability (m^3, source frame; of a sphere of radius a: -a^3/2 if it conducts perfectly, at most
/// a^3 if it is magnetic). Its moment is the polarisability times twice B of (4), which is half the field of a unit dipole. The
/// inducing field is that of dipoles at the source coils.
template <typename Scalar>
InducedDipole<Scalar> induced_dipole(const GeneralDipole<Scalar>& source, const Vec3<Scalar>& position_m,
                                     const Mat3<Scalar>& polarisability_m3) {
    InducedDipole<Scalar> dipole;
    dipole.position_m = position_m;
    for (int j = 0; j < 3; ++j) {
        const auto field =
            dipole_pair<Scalar>(position_m - source.source_offset_m.col(j), source.source_moment.col(j), Vec3<Scalar>::Zero());
        dipole.moment.col(j) = Scalar(2) * polarisability_m3 * field.by_sensitivity;
    }
    return dipole;
}

/// Column j (0-2) with its analytic Jacobian with respect to position and small rotation, both in the source frame; attitude q ->
/// exp(r) q. position_m: origin of the sensor frame in the source frame. No sensor coil may be at the centre of a source coil. o:
/// source components to sensor components.
template <typename Scalar>
ColumnModel<Scalar> column_model(const GeneralDipole<Scalar>& model, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o,
                                 int j) {
    ColumnModel<Scalar> column;
    const Vec3<Scalar> moment = model.source_moment.col(j);
    const Vec3<Scalar> from_coil = position_m - model.source_offset_m.col(j);
    for (int i = 0; i < 3; ++i) {
        const Vec3<Scalar> arm = o.transpose() * model.sensor_offset_m.col(i);
        const Vec3<Scalar> n = o.transpose() * model.sensor_sensitivity.col(i);
        const Vec3<Scalar> r = from_coil + arm;
        PairCoupling<Scalar> x = dipole_pair<Scalar>(r, moment, n);
        if (model.source_octupole_m2(j) != Scalar(0) || model.sensor_octupole_m2(i) != Scalar(0)) {
            x += octupole_correction<Scalar>(r, moment, n, model.source_octupole_m2(j), model.sensor_octupole_m2(i));
        }
        for (const InducedDipole<Scalar>& dipole : model.surroundings) {
            x += dipole_pair<Scalar>(position_m + arm - dipole.position_m, dipole.moment.col(j), n);
        }
        column.column(i) = x.value;
        column.by_position_per_m.row(i) = x.by_displacement_per_m;
        // A rotation w moves arm and n by w x arm and w x n: dX = g.(w x arm) + b.(w x n) = w.(arm x g + n x b).
        column.by_rotation_per_rad.row(i) = arm.cross(x.by_displacement_per_m) + n.cross(x.by_sensitivity);
    }
    return column;
}

/// All three columns: X(i, j) = output of sensor coil i while source coil j is excited.
template <typename Scalar>
Mat3<Scalar> signal_matrix(const GeneralDipole<Scalar>& model, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    Mat3<Scalar> x;
    for (int j = 0; j < 3; ++j) {
        x.col(j) = column_model(model, position_m, o, j).column;
    }
    return x;
}

/// Couplings of virtual dipoles alone, in the coils of the model.
template <typename Scalar>
Mat3<Scalar> induced_couplings(GeneralDipole<Scalar> model, const InducedDipoles<Scalar>& dipoles, const Vec3<Scalar>& position_m,
                               const Mat3<Scalar>& o) {
    model.surroundings = {};
    const Mat3<Scalar> bare = signal_matrix(model, position_m, o);
    model.surroundings = dipoles;
    return signal_matrix(model, position_m, o) - bare;
}

/// Signal matrix and Jacobian of vec(X), in column order, with respect to (position, small rotation), source frame: 9 x 6.
template <typename Scalar>
struct SignalModel {
    Mat3<Scalar> x;
    Matrix<Scalar, 9, 6> jacobian;
};

template <typename Scalar>
SignalModel<Scalar> signal_model(const GeneralDipole<Scalar>& model, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    SignalModel<Scalar> result;
    for (int j = 0; j < 3; ++j) {
        const ColumnModel<Scalar> column = column_model(model, position_m, o, j);
        result.x.col(j) = column.column;
        result.jacobian.template block<3, 3>(3 * j, 0) = column.by_position_per_m;
        result.jacobian.template block<3, 3>(3 * j, 3) = column.by_rotation_per_rad;
    }
    return result;
}

}  // namespace tricoil::field
