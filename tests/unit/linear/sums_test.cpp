// Sums and products differ from Eigen's by a few units in the last place of the sum of the absolute terms.
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "tests/unit/linear/oracle.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
using Fixed = Eigen::Matrix<Scalar, 3, 3>;

template <typename Scalar>
Oracle<Scalar> cross(const Oracle<Scalar>& a, const Oracle<Scalar>& b) {
    using Vector = Eigen::Matrix<Scalar, 3, 1>;
    return Vector(a).cross(Vector(b));
}

template <typename Scalar>
class LinearSums : public Linear<Scalar> {
protected:
    using typename Linear<Scalar>::Limits;

    template <int Rows, int Columns>
    void check_sums() {
        for (const auto& a : this->template any<Rows, Columns>()) {
            const Oracle<Scalar> ea = oracle(a);
            const Oracle<Scalar> absolute = ea.cwiseAbs();
            expect_close<Scalar>(a.sum(), ea.sum(), absolute.sum());
            expect_close<Scalar>(a.mean(), ea.mean(), absolute.mean());
            expect_close<Scalar>(a.trace(), ea.trace(), absolute.trace());
            expect_close<Scalar>(a.squaredNorm(), ea.squaredNorm(), ea.squaredNorm());
            expect_close<Scalar>(a.norm(), ea.norm(), ea.norm());
            expect_near(a.normalized(), ea.normalized(), ea.normalized().cwiseAbs());
            expect_near(a.colwise().sum(), ea.colwise().sum(), absolute.colwise().sum());
            expect_near(a.colwise().mean(), ea.colwise().mean(), absolute.colwise().mean());
            expect_near(a.colwise().norm(), ea.colwise().norm(), ea.colwise().norm());
            expect_near(a.colwise().squaredNorm(), ea.colwise().squaredNorm(), ea.colwise().squaredNorm());
            expect_near(a.rowwise().sum().transpose(), ea.rowwise().sum(), absolute.rowwise().sum());
            for (const auto& b : this->template any<Columns, 3>()) {
                expect_near(a * b, ea.lazyProduct(oracle(b)), absolute.lazyProduct(oracle(b).cwiseAbs()));
            }
        }
        for (const auto& a : this->template finite<Rows, Columns>()) {
            const Matrix<Scalar, Rows, Columns> near = a * (1 + 16 * Limits::epsilon());
            for (const Scalar tolerance : {4 * Limits::epsilon(), 64 * Limits::epsilon()}) {
                EXPECT_EQ(a.isApprox(near, tolerance), oracle(a).isApprox(oracle(near), tolerance));
            }
        }
    }
};
TYPED_TEST_SUITE(LinearSums, Scalars);

TYPED_TEST(LinearSums, DifferByRoundingOnly) {
    this->template check_sums<3, 1>();
    this->template check_sums<3, 3>();
    this->template check_sums<6, 6>();
    this->template check_sums<3, 12>();
}

TYPED_TEST(LinearSums, AreAddedFromLastToFirst) {
    using Scalar = TypeParam;
    const Scalar large = 4 / std::numeric_limits<Scalar>::epsilon();  // large + 1 is large
    const Vec3<Scalar> end(1, large, -large);                         // from first to last: 0
    const Vec3<Scalar> begin(-large, large, 1);                       // from first to last: 1
    const Vec3<Scalar> ones = Vec3<Scalar>::Ones();
    for (const auto& [terms, sum] : {std::pair(end, Scalar(1)), std::pair(begin, Scalar(0))}) {
        EXPECT_EQ(terms.sum(), sum);
        EXPECT_EQ(terms.dot(ones), sum);
        EXPECT_EQ((terms.transpose() * ones)(0), sum);
        EXPECT_EQ(Mat3<Scalar>(terms.asDiagonal()).trace(), sum);
        EXPECT_EQ(terms.colwise().sum()(0), sum);
        EXPECT_EQ((Mat3<Scalar>(terms * ones.transpose()).transpose() * ones)(2), sum);
    }
}

TYPED_TEST(LinearSums, CrossProductDeterminantAndInverse) {
    using Scalar = TypeParam;
    for (const auto& a : this->template any<3, 1>()) {
        for (const auto& b : this->template any<3, 1>()) {
            const Vec3<Scalar> p = a.cwiseAbs();
            const Vec3<Scalar> q = b.cwiseAbs();
            const Vec3<Scalar> terms(p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(), p.x() * q.y() + p.y() * q.x());
            expect_near(a.cross(b), cross(oracle(a), oracle(b)), oracle(terms));
        }
    }
    for (int n = 0; n < 1000; ++n) {
        const auto a = this->template random<3, 3>();
        const Mat3<Scalar> p = a.cwiseAbs();
        const Scalar terms = p(0, 0) * (p(1, 1) * p(2, 2) + p(1, 2) * p(2, 1)) +
                             p(1, 0) * (p(0, 1) * p(2, 2) + p(0, 2) * p(2, 1)) +
                             p(2, 0) * (p(0, 1) * p(1, 2) + p(0, 2) * p(1, 1));
        expect_close<Scalar>(a.determinant(), Fixed<Scalar>(oracle(a)).determinant(), terms);
        const Fixed<double> exact = Fixed<double>(oracle(a).template cast<double>()).inverse();
        const Fixed<double> sensitivity = exact.cwiseAbs() * oracle(p).template cast<double>() * exact.cwiseAbs();
        const Scalar determinant_share = terms / std::abs(a.determinant());
        expect_near(a.inverse(), Fixed<Scalar>(oracle(a)).inverse(), (sensitivity * determinant_share).template cast<Scalar>());
    }
    for (const Mat3<Scalar>& singular : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones()}) {
        EXPECT_EQ(singular.determinant(), Scalar(0));
        EXPECT_FALSE(singular.inverse().allFinite());
    }
}

TYPED_TEST(LinearSums, StableNormalizationTakesVectorsOfAnyLength) {
    using Scalar = TypeParam;
    using Range = typename TestFixture::Limits;
    const auto v = this->template random<3, 1>();
    for (const Scalar size : {Scalar(1), Range::min(), Range::max() / 8}) {
        const Vec3<Scalar> w = v * size;
        expect_near(w.stableNormalized(), oracle(w).stableNormalized(), Oracle<Scalar>::Ones(3, 1));
    }
    expect_same(Vec3<Scalar>(0, Range::denorm_min(), 0).stableNormalized(), Vec3<Scalar>::UnitY());
    expect_same(Vec3<Scalar>(0, 0, 0).stableNormalized(), Vec3<Scalar>::Zero());
}

}  // namespace
}  // namespace tricoil
