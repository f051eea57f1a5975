// Sums and products differ from Eigen's by a few units in the last place of the sum of the absolute terms.
#include <utility>

#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearSums : public Linear<Scalar> {
protected:
    using typename Linear<Scalar>::Limits;

    template <int Rows, int Columns>
    void check_sums() {
        for (const auto& a : this->template any<Rows, Columns>()) {
            const Oracle ea = oracle(a);
            const Oracle absolute = ea.cwiseAbs();
            expect_close(a.sum(), ea.sum(), absolute.sum());
            expect_close(a.transpose().sum(), ea.sum(), absolute.sum());  // not in the order in memory
            expect_close(a.mean(), ea.mean(), absolute.mean());
            expect_close(a.trace(), ea.trace(), absolute.trace());
            expect_close(a.squaredNorm(), ea.squaredNorm(), ea.squaredNorm());
            expect_near(a.colwise().sum(), ea.sums_of_columns(), absolute.sums_of_columns());
            expect_near(a.colwise().mean(), ea.means_of_columns(), absolute.means_of_columns());
            expect_near(a.colwise().squaredNorm(), ea.squared_norms_of_columns(), ea.squared_norms_of_columns());
            expect_near(a.rowwise().sum(), ea.transpose().sums_of_columns(), absolute.transpose().sums_of_columns());
            for (const auto& b : this->template any<Columns, 3>()) {
                expect_near(a * b, ea * oracle(b), absolute * oracle(b).cwiseAbs());
            }
            for (const auto& b : this->template any<Rows, Columns>()) {
                const Matrix<Scalar, Rows, Columns, Order::by_rows> rows = b;
                expect_close(a.dot(b), ea.dot(oracle(b)), absolute.dot(oracle(b).cwiseAbs()));
                expect_close(a.dot(rows), ea.dot(oracle(b)), absolute.dot(oracle(b).cwiseAbs()));
            }
            if (a.squaredNorm() < Limits::min() && !a.isZero(0)) {
                continue;  // squares underflow, in double at a smaller size
            }
            expect_close(a.norm(), ea.norm(), ea.norm());
            expect_near(a.colwise().norm(), ea.norms_of_columns(), ea.norms_of_columns());
            expect_near(a.normalized(), ea.normalized(), ea.normalized().cwiseAbs());
            auto unit = a;
            unit.normalize();
            expect_near(unit, ea.normalized(), ea.normalized().cwiseAbs());
        }
    }
};
TYPED_TEST_SUITE(LinearSums, Scalars);

TYPED_TEST(LinearSums, DifferByRoundingOnly) {
    if constexpr (std::is_same_v<TypeParam, float>) {
        this->template check_sums<3, 3>();
        this->template check_sums<6, 6>();
    } else {
        this->template check_sums<3, 1>();
        this->template check_sums<3, 12>();
    }
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

TYPED_TEST(LinearSums, ProductsOfSquareAndDiagonalMatrices) {
    using Scalar = TypeParam;
    const auto a = this->template random<3, 3>();
    const auto b = this->template random<3, 3>();
    auto product = a;
    product *= b;
    expect_near(product, oracle(a) * oracle(b), oracle(a).cwiseAbs() * oracle(b).cwiseAbs());
    const auto d = this->template random<3, 1>();
    const Oracle diagonal = oracle(d).asDiagonal();
    expect_same(Mat3<Scalar>(d.asDiagonal()), diagonal);
    expect_same(d.asDiagonal() * a, diagonal * oracle(a));
    expect_same(a * d.asDiagonal(), oracle(a) * diagonal);
}

TYPED_TEST(LinearSums, CrossProductDeterminantAndInverse) {
    using Scalar = TypeParam;
    for (const auto& a : this->template any<3, 1>()) {
        for (const auto& b : this->template any<3, 1>()) {
            const Vec3<Scalar> p = a.cwiseAbs();
            const Vec3<Scalar> q = b.cwiseAbs();
            const Vec3<Scalar> terms(p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(), p.x() * q.y() + p.y() * q.x());
            expect_near(a.cross(b), oracle(a).cross(oracle(b)), oracle(terms));
        }
    }
    for (int n = 0; n < 1000; ++n) {
        const auto a = this->template random<3, 3>();
        const Mat3<Scalar> p = a.cwiseAbs();
        const Scalar terms = p(0, 0) * (p(1, 1) * p(2, 2) + p(1, 2) * p(2, 1)) +
                             p(1, 0) * (p(0, 1) * p(2, 2) + p(0, 2) * p(2, 1)) +
                             p(2, 0) * (p(0, 1) * p(1, 2) + p(0, 2) * p(1, 1));
        expect_close(a.determinant(), oracle(a).determinant(), terms);
        const Oracle inverse = oracle(a).inverse();
        const Oracle sensitivity = inverse.cwiseAbs() * oracle(p) * inverse.cwiseAbs();
        const double determinant_share = double{terms} / std::abs(oracle(a).determinant());
        expect_near(a.inverse(), inverse, sensitivity * determinant_share);
        Mat3<Scalar> corner = Mat3<Scalar>::Identity();
        corner.template topLeftCorner<2, 2>() = a.template topLeftCorner<2, 2>();
        expect_close(a.template topLeftCorner<2, 2>().determinant(), oracle(corner).determinant(),
                     p(0, 0) * p(1, 1) + p(0, 1) * p(1, 0));
    }
    for (const Mat3<Scalar>& singular : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones()}) {
        EXPECT_EQ(singular.determinant(), Scalar(0));
        EXPECT_FALSE(singular.inverse().allFinite());
    }
}

TYPED_TEST(LinearSums, NormalizationOfVeryShortAndLongVectors) {
    using Scalar = TypeParam;
    using Range = typename TestFixture::Limits;
    const auto v = this->template random<3, 1>();
    for (const Scalar size : {Scalar(1), Range::min(), Range::max() / 8}) {
        const Vec3<Scalar> w = v * size;
        expect_near(w.stableNormalized(), oracle(w).stableNormalized(), Oracle::Constant(3, 1, 1));
    }
    const Vec3<Scalar> shortest(0, Range::denorm_min(), 0);
    expect_same(shortest.stableNormalized(), Vec3<Scalar>::UnitY());
    expect_same(shortest.normalized(), shortest);  // its square is zero
    EXPECT_EQ(shortest.norm(), Scalar(0));
    expect_same(Vec3<Scalar>(0, 0, 0).stableNormalized(), Vec3<Scalar>::Zero());
}

}  // namespace
}  // namespace tricoil
