// Eigenvectors and rotations agree with Eigen's.
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "core/linear/eigenvector.hpp"
#include "tests/unit/linear/oracle.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearRotations : public Linear<Scalar> {};
TYPED_TEST_SUITE(LinearRotations, Scalars);

template <typename Scalar>
Eigen::Quaternion<Scalar> reference(const Quaternion<Scalar>& q) {
    return {q.w(), q.x(), q.y(), q.z()};
}

/// v belongs to the largest eigenvalue: the error is that of the eigenvalue, of which `share` of the largest entry is allowed.
template <typename Scalar>
void check_eigenvector(const Mat3<Scalar>& m, double share) {
    const Vec3<Scalar> v = largest_eigenvector(m);
    const Eigen::Matrix3d exact = oracle(m).template cast<double>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> reference(exact);
    const Eigen::Vector3d d = oracle(v).template cast<double>();
    EXPECT_NEAR(d.norm(), 1, 4 * std::numeric_limits<Scalar>::epsilon());
    EXPECT_LE((exact * d - reference.eigenvalues()(2) * d).norm(), share * exact.cwiseAbs().maxCoeff()) << exact;
}

TYPED_TEST(LinearRotations, EigenvectorBelongsToTheLargestEigenvalue) {
    using Scalar = TypeParam;
    const double epsilon = std::numeric_limits<Scalar>::epsilon();
    const auto with = [&](double a, double b, double c) {
        const Eigen::Matrix3d axes = reference(this->rotation()).template cast<double>().normalized().toRotationMatrix();
        const Eigen::Matrix3d m = axes * Eigen::Vector3d(a, b, c).asDiagonal() * axes.transpose();
        const Eigen::Matrix3d symmetric = 0.5 * (m + m.transpose());
        return Mat3<Scalar>(symmetric.template cast<Scalar>());
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
    using Vector4 = Matrix<Scalar, 4, 1>;
    const auto attitudes = [this] {
        std::vector<Quaternion<Scalar>> all{Quaternion<Scalar>::Identity(), {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
        for (int n = 0; n < 30; ++n) {
            all.push_back(this->rotation());
        }
        all.push_back(Quaternion<Scalar>(Scalar(1e-4), 1, Scalar(-1e-4), 0).normalized());
        return all;
    }();
    for (const auto& p : attitudes) {
        const Eigen::Quaternion<Scalar> ep = reference(p);
        expect_same(p.conjugate().coeffs(), ep.conjugate().coeffs());
        expect_near(p.toRotationMatrix(), ep.toRotationMatrix(), oracle(Mat3<Scalar>::Constant(3)));
        const Mat3<Scalar> rotation = p.toRotationMatrix();
        expect_near(Quaternion<Scalar>(rotation).coeffs(),
                    Eigen::Quaternion<Scalar>(Eigen::Matrix<Scalar, 3, 3>(oracle(rotation))).coeffs(), oracle(Vector4::Ones()));
        expect_close<Scalar>(p.norm(), ep.norm(), 1);
        for (const auto& q : attitudes) {
            const Eigen::Quaternion<Scalar> eq = reference(q);
            expect_near((p * q).coeffs(), (ep * eq).coeffs(), oracle(Vector4::Ones()));
            expect_close<Scalar>(p.dot(q), ep.dot(eq), 1);
            if (std::abs(p.dot(q)) > Scalar(1e-3)) {  // at zero, the sign is one of rounding
                for (const Scalar t : {Scalar(0), Scalar(0.3), Scalar(1)}) {
                    expect_near(p.slerp(t, q).coeffs(), ep.slerp(t, eq).coeffs(), oracle(Vector4::Ones()));
                }
            }
        }
        for (const auto& v : this->template finite<3, 1>()) {
            expect_near(p * v, ep * Eigen::Matrix<Scalar, 3, 1>(oracle(v)), oracle(Vec3<Scalar>::Constant(6 * v.norm())));
        }
    }
}

}  // namespace
}  // namespace tricoil
