#include "core/solver/direct.hpp"

#include <cmath>
#include <limits>

#include "core/base/precision.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigenvector.hpp"

namespace tricoil::solver {
namespace {

/// First right singular vector of x. Its singular value is twice the others for any dipole, so the closed-form eigenvector of x^T
/// x is well conditioned even if the other two are equal.
template <typename Scalar>
Vec3<Scalar> first_right_singular_vector(const Mat3<Scalar>& x) {
    return largest_eigenvector<Scalar>(x.transpose() * x).normalized();
}

template <typename Scalar>
Scalar square(Scalar value) {
    return value * value;
}

}  // namespace

template <typename Scalar>
Result<DirectSolution<Scalar>> solve_direct(const Mat3<Scalar>& x, Scalar coupling_constant) {
    if (!x.allFinite()) {
        return Status{StatusCode::not_finite, "signal matrix contains NaN or infinity"};
    }
    const Scalar scale = x.cwiseAbs().maxCoeff();
    if (!(scale > std::numeric_limits<Scalar>::min())) {
        return Status{StatusCode::degenerate, "signal matrix is zero: no field at the sensor"};
    }
    const Mat3<Scalar> y = x / scale;
    const Vec3<Scalar> v1 = first_right_singular_vector(y);
    const Vec3<Scalar> image = y * v1;
    const Scalar s1 = image.norm();
    const Vec3<Scalar> u1 = image / s1;

    // In the plane normal to v1 the other two singular pairs may be equal, so only their sum and their polar factor are computed:
    // with B = (Y E)^T (Y E) of 2x2, B^(1/2) = (B + sqrt(det B) I) / t, t = s2 + s3 = sqrt(tr B + 2 sqrt(det B)).
    const Matrix<Scalar, 3, 2> e = geometry::transverse_axes(v1);
    const Matrix<Scalar, 3, 2> ye = y * e;
    const Scalar b11 = ye.col(0).squaredNorm();
    const Scalar b22 = ye.col(1).squaredNorm();
    const Scalar b12 = ye.col(0).dot(ye.col(1));
    const Scalar determinant = ye.col(0).cross(ye.col(1)).squaredNorm();  // b11 b22 - b12^2, without cancellation
    const Scalar root = std::sqrt(determinant);                           // s2 s3
    const Scalar sum = std::sqrt(b11 + b22 + 2 * root);                   // s2 + s3
    if (!(root > 8 * std::numeric_limits<Scalar>::epsilon())) {
        return Status{StatusCode::degenerate, "signal matrix has rank below three: a coil or a channel is dead"};
    }
    Matrix<Scalar, 2, 2> inverse_root;
    inverse_root << b22 + root, -b12, -b12, b11 + root;
    inverse_root /= sum * root;
    const Matrix<Scalar, 3, 2> polar = ye * inverse_root;

    const Scalar k = (2 * s1 + sum) / 3;
    const Scalar difference_squared = square(b11 - b22) + 4 * square(b12);  // (s2^2 - s3^2)^2
    DirectSolution<Scalar> solution;
    solution.strength = k * scale;
    solution.range_m = std::cbrt(coupling_constant / solution.strength);
    solution.direction = v1;
    solution.attitude = u1 * v1.transpose() - polar * e.transpose();
    // |X - model|^2 = (s1 - k)^2 + (s2 - k/2)^2 + (s3 - k/2)^2 = 1/3 (s1 - s2 - s3)^2 + 1/2 (s2 - s3)^2.
    solution.misfit_squared = square(scale) * (square(s1 - sum) / 3 + difference_squared / (2 * square(sum)));
    solution.right_handed = u1.dot(ye.col(0).cross(ye.col(1))) > 0;
    return solution;
}

template Result<DirectSolution<float>> solve_direct(const Mat3<float>&, float);
#if TRICOIL_SCALARS & 2  // double
template Result<DirectSolution<double>> solve_direct(const Mat3<double>&, double);
#endif

}  // namespace tricoil::solver
