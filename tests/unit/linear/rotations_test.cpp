// Eigenvectors and rotations agree with Eigen's.
#include "core/linear/eigenvector.hpp"
#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearRotations : public Linear<Scalar> {
protected:
    std::vector<Quat<Scalar>> attitudes() {
        using Column = Matrix<Scalar, 4, 1>;
        std::vector<Quat<Scalar>> all{Quat<Scalar>::Identity(), {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
        for (int n = 0; n < 30; ++n) {
            all.push_back(this->rotation());
        }
        for (const Column& nearly_half_turn : {Column(1, Scalar(-1e-4), 0, Scalar(1e-4)), Column(0, 1, 2, Scalar(1e-3)),
                                               Column(1, 2, 3, Scalar(-0.1)), Column(3, -2, 1, Scalar(0.1))}) {
            all.push_back(Quat<Scalar>(nearly_half_turn).normalized());
        }
        return all;
    }
};
TYPED_TEST_SUITE(LinearRotations, Scalars);

/// v belongs to the largest eigenvalue: the error is that of the eigenvalue, of which `share` of the largest entry is allowed.
template <typename Scalar>
void check_eigenvector(const Mat3<Scalar>& m, double share) {
    const Oracle v(largest_eigenvector(m));
    const Oracle exact(m);
    EXPECT_NEAR(v.norm(), 1, 4 * std::numeric_limits<Scalar>::epsilon());
    EXPECT_LE((exact * v - v * exact.largest_eigenvalue()).norm(), share * exact.cwiseAbs().maxCoeff());
}

TYPED_TEST(LinearRotations, EigenvectorBelongsToTheLargestEigenvalue) {
    using Scalar = TypeParam;
    const double epsilon = std::numeric_limits<Scalar>::epsilon();
    const auto with = [&](double a, double b, double c) {
        const Mat3<double> axes = this->rotation().template cast<double>().normalized().toRotationMatrix();
        const Mat3<double> m = axes * Vec3<double>(a, b, c).asDiagonal() * axes.transpose();
        return Mat3<Scalar>((0.5 * (m + m.transpose())).template cast<Scalar>());
    };
    for (int n = 0; n < 200; ++n) {
        for (const double size : {1.0, 1e-9, 1e9}) {
            check_eigenvector<Scalar>(with(size, -2 * size, 5 * size), 64 * epsilon);
            check_eigenvector<Scalar>(with(size, size, 4 * size), 64 * epsilon);
            // Nearly equal largest eigenvalues: the polynomial determines them within the square root of the resolution.
            for (const double gap : {0.0, 1e-12, 1e-6, 1e-3}) {
                check_eigenvector<Scalar>(with(-size, 2 * size, 2 * size * (1 + gap)), 8 * std::sqrt(epsilon));
                check_eigenvector<Scalar>(with(size, size, size * (1 + gap)), 8 * std::sqrt(epsilon));
            }
        }
    }
    check_eigenvector<Scalar>(Mat3<Scalar>::Zero(), 0);
    check_eigenvector<Scalar>(Mat3<Scalar>::Identity(), 0);
    check_eigenvector<Scalar>(Vec3<Scalar>(2, 1, 2).asDiagonal(), 0);
    check_eigenvector<Scalar>(Mat3<Scalar>::Constant(std::numeric_limits<Scalar>::denorm_min()), 2);
}

TYPED_TEST(LinearRotations, QuaternionsAgreeWithEigen) {
    using Scalar = TypeParam;
    const Oracle ones = Oracle::Constant(4, 1, 1);
    const auto attitudes = this->attitudes();
    for (const Quat<Scalar>& p : attitudes) {
        const Oracle ep = oracle(p);
        expect_same(p.conjugate().coeffs(), ep.conjugate());
        const Mat3<Scalar> rotation = p.toRotationMatrix();
        expect_near(rotation, ep.toRotationMatrix(), Oracle::Constant(3, 3, 3));
        expect_near(Quat<Scalar>(rotation).coeffs(), Oracle::quaternion(oracle(rotation)), ones);
        for (const Quat<Scalar>& q : attitudes) {
            expect_near((p * q).coeffs(), ep.times(oracle(q)), ones);
            expect_close(p.dot(q), ep.dot(oracle(q)), 1);
            if (std::abs(p.dot(q)) > Scalar(1e-3)) {  // at zero, the sign is one of rounding
                for (const Scalar t : {Scalar(0), Scalar(0.3), Scalar(1)}) {
                    expect_near(p.slerp(t, q).coeffs(), ep.slerp(t, oracle(q)), ones);
                }
            }
        }
        for (const auto& v : this->template finite<3, 1>()) {
            expect_near(p * v, ep.rotate(oracle(v)), Oracle::Constant(3, 1, 6 * oracle(v).norm()));
        }
    }
}

TYPED_TEST(LinearRotations, QuaternionsAreColumnsOfFour) {
    using Column = Matrix<TypeParam, 4, 1>;
    Quat<TypeParam> q(4, 1, 2, 3);
    const Quat<TypeParam>& same = q;
    expect_same(q.coeffs(), Column(1, 2, 3, 4));
    expect_same(Quat<TypeParam>(Column(1, 2, 3, 4)).coeffs(), Column(1, 2, 3, 4));
    expect_same(q.template cast<float>().coeffs(), Column(1, 2, 3, 4));
    expect_same(Column(same.x(), same.y(), same.z(), same.w()), Column(1, 2, 3, 4));
    expect_same(same.vec(), Vec3<TypeParam>(1, 2, 3));
    q.x() = 6;
    q.y() = 7;
    q.z() = 8;
    q.w() = 9;
    expect_same(same.coeffs(), Column(6, 7, 8, 9));
    q.vec() *= TypeParam(2);
    expect_same(same.coeffs(), Column(12, 14, 16, 9));
    const Oracle unit = oracle(q).normalized();
    expect_close(q.norm(), oracle(q).norm(), oracle(q).norm());
    expect_close(q.squaredNorm(), oracle(q).squaredNorm(), oracle(q).squaredNorm());
    expect_near(q.normalized().coeffs(), unit, unit);
    q.normalize();
    expect_near(q.coeffs(), unit, unit);
    expect_same(q.setIdentity().coeffs(), Column(0, 0, 0, 1));
}

}  // namespace
}  // namespace tricoil
