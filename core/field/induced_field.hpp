// Couplings of ideal triads to virtual dipoles: metal at rest.
#pragma once

#include <cmath>

#include "core/field/concentric_dipole.hpp"
#include "core/field/induced_dipole.hpp"

namespace tricoil::field {

/// Adds the couplings of the dipoles to column j (0-2), and their derivatives to its Jacobian. position_m, o: as in
/// column_model(). Not inlined, to save stack.
template <typename Scalar>
[[gnu::noinline]] void add_induced(const InducedDipoles<Scalar>& dipoles, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o,
                                   int j, ColumnModel<Scalar>& column) {
    Vec3<Scalar> b = Vec3<Scalar>::Zero();
    Mat3<Scalar> db = Mat3<Scalar>::Zero();
    for (const InducedDipole<Scalar>& dipole : dipoles) {
        const Vec3<Scalar> r = position_m - dipole.position_m;
        const Scalar inverse = Scalar(1) / std::sqrt(r.squaredNorm());
        const Vec3<Scalar> u = r * inverse;
        const auto m = dipole.moment.col(j);
        const Scalar along = u.dot(m);
        const Scalar strength = inverse * inverse * inverse / 2;
        // The field of dipole_pair() and dB/dp as in column_model().
        b += strength * (3 * along * u - m);
        const Scalar slope = 3 * strength * inverse;
        db += slope * (u * m.transpose() + m * u.transpose() - 5 * along * u * u.transpose());
        db.diagonal() += Vec3<Scalar>::Constant(slope * along);
    }
    column.column += o * b;
    column.by_position_per_m += o * db;
    column.by_rotation_per_rad += geometry::times_skew<Scalar>(o, b);
}

/// Couplings of the dipoles: a summand of X.
template <typename Scalar>
Mat3<Scalar> induced_couplings(const InducedDipoles<Scalar>& dipoles, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    Mat3<Scalar> b = Mat3<Scalar>::Zero();  // fields, one column per source coil
    for (const InducedDipole<Scalar>& dipole : dipoles) {
        const Vec3<Scalar> r = position_m - dipole.position_m;
        const Scalar range_m = r.norm();
        b += dipole_factor<Scalar>(r / range_m) * dipole.moment / (range_m * range_m * range_m);
    }
    return o * b;
}

}  // namespace tricoil::field
