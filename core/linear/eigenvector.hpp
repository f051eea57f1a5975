// Eigenvector of a symmetric 3x3 matrix in closed form.
#pragma once

#include <algorithm>

#include "core/linear/matrix.hpp"

namespace tricoil {

/// Largest root of the characteristic polynomial of a symmetric matrix with trace zero and largest entry one, by the
/// trigonometric solution of a cubic equation (Kopp 2008, "Efficient numerical diagonalization of hermitian 3x3 matrices",
/// section 3).
template <typename Scalar>
Scalar largest_root(const Mat3<Scalar>& m) {
    const Scalar c0 = m(0, 0) * m(1, 1) * m(2, 2) + 2 * m(1, 0) * m(2, 0) * m(2, 1) - m(0, 0) * m(2, 1) * m(2, 1) -
                      m(1, 1) * m(2, 0) * m(2, 0) - m(2, 2) * m(1, 0) * m(1, 0);
    const Scalar c1 =
        m(0, 0) * m(1, 1) - m(1, 0) * m(1, 0) + m(0, 0) * m(2, 2) - m(2, 0) * m(2, 0) + m(1, 1) * m(2, 2) - m(2, 1) * m(2, 1);
    constexpr Scalar kThird = Scalar(1) / Scalar(3);
    const Scalar middle = (m(0, 0) + m(1, 1) + m(2, 2)) * kThird;
    const Scalar p = std::max((3 * middle * middle - c1) * kThird, Scalar(0));
    const Scalar half_q = Scalar(0.5) * (c0 + middle * (2 * middle * middle - c1));
    const Scalar discriminant = std::max(p * p * p - half_q * half_q, Scalar(0));
    return middle + 2 * std::sqrt(p) * std::cos(std::atan2(std::sqrt(discriminant), half_q) * kThird);
}

/// Unit eigenvector of the largest eigenvalue of a finite symmetric matrix; the sign is arbitrary. If eigenvalues are equal, one
/// of their eigenvectors.
template <typename Scalar>
Vec3<Scalar> largest_eigenvector(const Mat3<Scalar>& symmetric) {
    Mat3<Scalar> m = symmetric;
    m.diagonal() -= Vec3<Scalar>::Constant(m.trace() / 3);
    const Scalar scale = m.cwiseAbs().maxCoeff();
    if (!(scale > Scalar(0))) {
        return Vec3<Scalar>::UnitZ();  // all eigenvalues are equal
    }
    m /= scale;
    m.diagonal() -= Vec3<Scalar>::Constant(largest_root(m));
    // The rows of m - lambda I are orthogonal to the eigenvector.
    Index i = 0;
    m.diagonal().cwiseAbs().maxCoeff(&i);
    const Vec3<Scalar> row = m.col(i);
    const Vec3<Scalar> a = row.cross(m.col((i + 1) % 3));
    const Vec3<Scalar> b = row.cross(m.col((i + 2) % 3));
    const Scalar a2 = a.squaredNorm();
    const Scalar b2 = b.squaredNorm();
    if (std::max(a2, b2) > std::numeric_limits<Scalar>::epsilon()) {  // of squares: shorter products are mostly rounding
        return a2 > b2 ? Vec3<Scalar>(a / std::sqrt(a2)) : Vec3<Scalar>(b / std::sqrt(b2));
    }
    // Two equal largest eigenvalues: any vector orthogonal to the row.
    Index smallest = 0;
    row.cwiseAbs().minCoeff(&smallest);
    return row.cross(Vec3<Scalar>::Unit(smallest)).normalized();
}

}  // namespace tricoil
