// The nine couplings as a vector, and the covariance of the pose that they determine.
#pragma once

#include "core/linear/cholesky.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::tracking {

using Vec9 = Matrix<double, 9, 1>;

/// Of the nine couplings by position (m) and small rotation (rad).
using PoseJacobian = Matrix<double, 9, 6>;

/// Column by column.
inline Vec9 vec(const Mat3<double>& m) { return m.reshaped(); }

/// Covariance of (position, small rotation) for unit noise of each coupling; zero if it is not determined. Computed with lengths
/// relative to the range, for better conditioning.
inline Mat6<double> unit_covariance(const PoseJacobian& jacobian, double range_m) {
    Vec6<double> units = Vec6<double>::Ones();
    units.head<3>().setConstant(range_m);
    const PoseJacobian j = jacobian * units.asDiagonal();
    const Mat6<double> information = j.transpose() * j;
    const Cholesky<double, 6> cholesky(information);
    if (!cholesky.ok()) {
        return Mat6<double>::Zero();
    }
    const Mat6<double> inverse = cholesky.solve<6>(Mat6<double>::Identity());
    return units.asDiagonal() * inverse * units.asDiagonal();
}

}  // namespace tricoil::tracking
