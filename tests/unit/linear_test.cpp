// core/linear against Eigen. Operations on single entries have the same bits; sums and products differ by a few units in the last
// place of the sum of the absolute terms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/linear/cholesky.hpp"
#include "core/linear/eigen.hpp"
#include "core/linear/eigenvector.hpp"

namespace tricoil {
namespace {

template <typename Scalar, int Rows, int Columns>
using Eigens = EigenMatrix<Scalar, Rows, Columns, Order::by_columns>;

constexpr double kUnits = 8;  // in the last place; a sum of twelve terms, twice

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// Of matrices of any library, bit for bit except for the kind of NaN.
template <typename A, typename B>
void expect_same(const A& a, const B& b) {
    ASSERT_EQ(a.rows(), b.rows());
    ASSERT_EQ(a.cols(), b.cols());
    for (Index i = 0; i < a.rows(); ++i) {
        for (Index j = 0; j < a.cols(); ++j) {
            EXPECT_TRUE(same(a(i, j), b(i, j))) << a(i, j) << " instead of " << b(i, j) << " at " << i << ", " << j;
        }
    }
}

template <typename Scalar>
void expect_close(Scalar a, Scalar b, Scalar absolute_terms, double units = kUnits) {
    if (!std::isfinite(b)) {
        EXPECT_TRUE(same(a, b)) << a << " instead of " << b;
        return;
    }
    const double tolerance = units * (std::numeric_limits<Scalar>::epsilon() * static_cast<double>(absolute_terms) +
                                      std::numeric_limits<Scalar>::denorm_min());
    EXPECT_LE(std::abs(static_cast<double>(a) - b), tolerance) << a << " instead of " << b;
}

template <typename A, typename B, typename C>
void expect_near(const A& a, const B& b, const C& absolute_terms, double units = kUnits) {
    ASSERT_EQ(a.rows(), b.rows());
    ASSERT_EQ(a.cols(), b.cols());
    for (Index i = 0; i < a.rows(); ++i) {
        for (Index j = 0; j < a.cols(); ++j) {
            using Scalar = std::remove_cvref_t<decltype(b(i, j))>;
            expect_close<Scalar>(a(i, j), b(i, j), absolute_terms(i, j), units);
        }
    }
}

template <typename Scalar>
class Linear : public ::testing::Test {
protected:
    using Limits = std::numeric_limits<Scalar>;

    template <int Rows, int Columns>
    Matrix<Scalar, Rows, Columns> random(Scalar size = 1) {
        return Matrix<Scalar, Rows, Columns>::NullaryExpr([&] { return size * static_cast<Scalar>(normal_(random_)); });
    }
    Quaternion<Scalar> rotation() { return Quaternion<Scalar>(random<4, 1>().normalized()); }

    /// Random, zero, singular, very small and denormal.
    template <int Rows, int Columns>
    std::vector<Matrix<Scalar, Rows, Columns>> finite() {
        using M = Matrix<Scalar, Rows, Columns>;
        std::vector<M> all{M::Zero(), M::Ones(), M::Constant(Limits::denorm_min()), M::Constant(-Limits::min())};
        for (const double size : {1.0, 1.0, 1.0, 1e-3, 1e3, 1e-12, 1e12}) {
            all.push_back(random<Rows, Columns>(static_cast<Scalar>(size)));
        }
        all.push_back(random<Rows, 1>() * random<1, Columns>());
        all.push_back(random<Rows, Columns>());
        all.back()(Rows * Columns - 1) = Limits::denorm_min();
        return all;
    }
    /// Also NaN and infinities.
    template <int Rows, int Columns>
    std::vector<Matrix<Scalar, Rows, Columns>> any() {
        auto all = finite<Rows, Columns>();
        for (const Scalar bad : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity()}) {
            for (const Index entry : {0, Rows * Columns - 1}) {
                all.push_back(random<Rows, Columns>());
                all.back()(entry) = bad;
            }
        }
        all.push_back(random<Rows, Columns>());
        all.back()(0) = Limits::infinity();
        all.back()(Rows * Columns - 1) = -Limits::infinity();
        return all;
    }

    template <int Rows, int Columns>
    void check_entries() {
        for (const auto& a : any<Rows, Columns>()) {
            for (const auto& b : any<Rows, Columns>()) {
                const Eigens<Scalar, Rows, Columns> ea = eigen(a);
                const Eigens<Scalar, Rows, Columns> eb = eigen(b);
                const auto expect_both = [&](auto f) { expect_same(f(a, b), f(ea, eb)); };
                expect_both([](const auto& m, const auto& n) { return m + n; });
                expect_both([](const auto& m, const auto& n) { return m - n; });
                expect_both([](const auto& m, const auto& n) { return m.cwiseProduct(n); });
                expect_both([](const auto& m, const auto& n) { return m.cwiseQuotient(n); });
                EXPECT_EQ(a == b, ea == eb);
                EXPECT_EQ(a == a, ea == ea);
            }
            const Eigens<Scalar, Rows, Columns> ea = eigen(a);
            const auto expect_both = [&](auto f) { expect_same(f(a), f(ea)); };
            expect_both([](const auto& m) { return -m; });
            expect_both([](const auto& m) { return m * Scalar(0.3); });
            expect_both([](const auto& m) { return Scalar(0.3) * m; });
            expect_both([](const auto& m) { return m / Scalar(0.3); });
            expect_both([](const auto& m) { return m.cwiseAbs(); });
            expect_both([](const auto& m) { return m.cwiseAbs2(); });
            expect_both([](const auto& m) { return m.cwiseInverse(); });
            expect_both([](const auto& m) { return m.template cast<float>(); });
            expect_both([](const auto& m) { return m.transpose(); });
            expect_same(a.cwiseAbs().cwiseSqrt(), ea.cwiseAbs().cwiseSqrt());
            EXPECT_EQ(a.allFinite(), ea.allFinite());
            for (const Scalar tolerance : {Scalar(0), Scalar(1e-3), Scalar(10)}) {
                EXPECT_EQ(a.isZero(tolerance), ea.isZero(tolerance));
            }
            auto changed = a;
            auto expected = ea;
            changed += a * Scalar(2);
            expected += ea * Scalar(2);
            changed -= a / Scalar(7);
            expected -= ea / Scalar(7);
            changed *= Scalar(3);
            expected *= Scalar(3);
            changed /= Scalar(11);
            expected /= Scalar(11);
            expect_same(changed, expected);
        }
        for (const auto& a : finite<Rows, Columns>()) {
            const auto b = random<Rows, Columns>();
            expect_same(a.cwiseMax(b), eigen(a).cwiseMax(eigen(b)));
            expect_same(a.cwiseMin(b), eigen(a).cwiseMin(eigen(b)));
            EXPECT_EQ(a.maxCoeff(), eigen(a).maxCoeff());
            EXPECT_EQ(a.minCoeff(), eigen(a).minCoeff());
        }
    }

    template <int Rows, int Columns>
    void check_sums() {
        for (const auto& a : any<Rows, Columns>()) {
            const auto ea = eigen(a);
            const auto absolute = ea.cwiseAbs();
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
            for (const auto& b : any<Columns, 3>()) {
                expect_near(a * b, ea * eigen(b), absolute * eigen(b).cwiseAbs());
            }
        }
        for (const auto& a : finite<Rows, Columns>()) {
            const Matrix<Scalar, Rows, Columns> near = a * (1 + 16 * Limits::epsilon());
            for (const Scalar tolerance : {4 * Limits::epsilon(), 64 * Limits::epsilon()}) {
                EXPECT_EQ(a.isApprox(near, tolerance), eigen(a).isApprox(eigen(near), tolerance));
            }
        }
    }

private:
    std::mt19937_64 random_{17};
    std::normal_distribution<double> normal_;
};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Linear, Scalars);

TYPED_TEST(Linear, OperationsOnEntriesHaveTheSameBits) {
    this->template check_entries<3, 1>();
    this->template check_entries<3, 3>();
    this->template check_entries<3, 12>();
}

TYPED_TEST(Linear, SumsDifferByRoundingOnly) {
    this->template check_sums<3, 1>();
    this->template check_sums<3, 3>();
    this->template check_sums<6, 6>();
    this->template check_sums<3, 12>();
}

TYPED_TEST(Linear, SumsAreAddedFromLastToFirst) {
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

TYPED_TEST(Linear, PartsReferToTheSameEntries) {
    using Scalar = TypeParam;
    auto a = this->template random<6, 9>();
    Eigens<Scalar, 6, 9> ea = eigen(a);
    const auto expect_both = [&](auto part) {
        expect_same(part(std::as_const(a)), part(std::as_const(ea)));
        part(a) *= Scalar(-2);
        part(ea) *= Scalar(-2);
        expect_same(a, ea);
        part(a).setConstant(Scalar(0.7));
        part(ea).setConstant(Scalar(0.7));
        expect_same(a, ea);
        a = this->template random<6, 9>();
        ea = eigen(a);
    };
    expect_both([](auto& m) { return m.row(4); });
    expect_both([](auto& m) { return m.col(7); });
    expect_both([](auto& m) { return m.template block<2, 3>(1, 5); });
    expect_both([](auto& m) { return m.template topLeftCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template topRightCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template bottomLeftCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template bottomRightCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template topRows<2>(); });
    expect_both([](auto& m) { return m.template middleRows<2>(3); });
    expect_both([](auto& m) { return m.template bottomRows<2>(); });
    expect_both([](auto& m) { return m.template leftCols<4>(); });
    expect_both([](auto& m) { return m.template middleCols<4>(2); });
    expect_both([](auto& m) { return m.template rightCols<4>(); });
    expect_both([](auto& m) { return m.transpose(); });
    expect_both([](auto& m) { return m.diagonal(); });
    expect_both([](auto& m) { return m.col(3).template segment<2>(1); });
    expect_both([](auto& m) { return m.row(3).template head<4>(); });
    expect_both([](auto& m) { return m.row(3).template tail<4>(); });
    expect_both([](auto& m) { return m.transpose().row(2).template tail<3>(); });
    expect_same(a.reshaped(), ea.reshaped());
    a.template leftCols<3>() = Matrix<Scalar, 6, 3>(a.template middleCols<3>(1));
    ea.template leftCols<3>() = ea.template middleCols<3>(1).eval();
    expect_same(a, ea);
    a.template topLeftCorner<6, 6>() = a.template topLeftCorner<6, 6>().transpose();  // overlaps
    ea.template topLeftCorner<6, 6>() = ea.template topLeftCorner<6, 6>().transpose().eval();
    expect_same(a, ea);
    a.colwise() -= a.col(2);
    ea.colwise() -= ea.col(2).eval();
    expect_same(a, ea);
}

TYPED_TEST(Linear, CommasFillRowAfterRow) {
    using Scalar = TypeParam;
    const auto block = this->template random<2, 2>();
    const auto column = this->template random<2, 1>();
    const auto row = this->template random<1, 3>();
    Mat3<Scalar> a;
    Eigens<Scalar, 3, 3> ea;
    a << block, column, row;
    ea << eigen(block), eigen(column), eigen(row);
    expect_same(a, ea);
    a << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    ea << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    expect_same(a, ea);
}

TYPED_TEST(Linear, CrossProductDeterminantAndInverse) {
    using Scalar = TypeParam;
    for (const auto& a : this->template any<3, 1>()) {
        for (const auto& b : this->template any<3, 1>()) {
            const Vec3<Scalar> p = a.cwiseAbs();
            const Vec3<Scalar> q = b.cwiseAbs();
            const Vec3<Scalar> terms(p.y() * q.z() + p.z() * q.y(), p.z() * q.x() + p.x() * q.z(), p.x() * q.y() + p.y() * q.x());
            expect_near(a.cross(b), eigen(a).cross(eigen(b)), terms);
        }
    }
    for (int n = 0; n < 1000; ++n) {
        const auto a = this->template random<3, 3>();
        const Mat3<Scalar> p = a.cwiseAbs();
        const Scalar terms = p(0, 0) * (p(1, 1) * p(2, 2) + p(1, 2) * p(2, 1)) +
                             p(1, 0) * (p(0, 1) * p(2, 2) + p(0, 2) * p(2, 1)) +
                             p(2, 0) * (p(0, 1) * p(1, 2) + p(0, 2) * p(1, 1));
        expect_close<Scalar>(a.determinant(), eigen(a).determinant(), terms);
        const Eigens<double, 3, 3> exact = eigen(a).template cast<double>().inverse();
        const Eigens<double, 3, 3> sensitivity = exact.cwiseAbs() * eigen(p).template cast<double>() * exact.cwiseAbs();
        const Scalar determinant_share = terms / std::abs(a.determinant());
        expect_near(a.inverse(), Eigens<Scalar, 3, 3>(eigen(a).inverse()),
                    Eigens<Scalar, 3, 3>((sensitivity * determinant_share).template cast<Scalar>()));
    }
    for (const Mat3<Scalar>& singular : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones()}) {
        EXPECT_EQ(singular.determinant(), Scalar(0));
        EXPECT_FALSE(singular.inverse().allFinite());
    }
}

TYPED_TEST(Linear, StableNormalizationTakesVectorsOfAnyLength) {
    using Scalar = TypeParam;
    using Limits = std::numeric_limits<Scalar>;
    const auto v = this->template random<3, 1>();
    for (const Scalar size : {Scalar(1), Limits::min(), Limits::max() / 8}) {
        const Vec3<Scalar> w = v * size;
        expect_near(w.stableNormalized(), eigen(w).stableNormalized(), Vec3<Scalar>::Ones());
    }
    expect_same(Vec3<Scalar>(0, Limits::denorm_min(), 0).stableNormalized(), Vec3<Scalar>::UnitY());
    expect_same(Vec3<Scalar>(0, 0, 0).stableNormalized(), Vec3<Scalar>::Zero());
}

template <typename Scalar, int N>
void check_cholesky(const Matrix<Scalar, N, N>& a, const Matrix<Scalar, N, 2>& b) {
    const Eigen::LLT<Eigens<Scalar, N, N>> reference(eigen(a));
    const Cholesky<Scalar, N> ours(a);
    ASSERT_EQ(ours.ok(), reference.info() == Eigen::Success);
    if (!ours.ok()) {
        return;
    }
    // Backward errors: Higham, "Accuracy and stability of numerical algorithms", section 10.1.
    const Eigens<Scalar, N, N> lower = reference.matrixL();
    const Matrix<Scalar, N, 2> x = ours.solve(b);
    const Eigens<Scalar, N, 2> terms = lower.cwiseAbs() * (lower.transpose().cwiseAbs() * eigen(x).cwiseAbs());
    expect_near(a * x, eigen(b), Eigens<Scalar, N, 2>(terms + eigen(b).cwiseAbs()), 4 * N);
    const Matrix<Scalar, N, 2> y = ours.solve_lower(b);
    const Eigens<Scalar, N, 2> expected = reference.matrixL().solve(eigen(b));
    const Eigens<Scalar, N, N> inverse = lower.inverse();
    const Eigens<Scalar, N, 2> effect =
        inverse.cwiseAbs() *
        (lower.cwiseAbs() * (lower.transpose().cwiseAbs() * (inverse.transpose().cwiseAbs() * expected.cwiseAbs())));
    expect_near(y, expected, effect, 4 * N);
}

TYPED_TEST(Linear, CholeskySolvesLikeEigen) {
    using Scalar = TypeParam;
    for (int n = 0; n < 100; ++n) {
        const auto small = this->template random<3, 3>();
        check_cholesky<Scalar, 3>(small * small.transpose() + Scalar(0.1) * Mat3<Scalar>::Identity(),
                                  this->template random<3, 2>());
        const auto root = this->template random<6, 6>();
        check_cholesky<Scalar, 6>(root * root.transpose() + Scalar(0.1) * Mat6<Scalar>::Identity(),
                                  this->template random<6, 2>());
        check_cholesky<Scalar, 6>(root + root.transpose(), this->template random<6, 2>());  // mostly indefinite
    }
    for (const auto& a : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones(), Mat3<Scalar>::Constant(-1)}) {
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
    for (Index entry = 0; entry < 3; ++entry) {
        Mat3<Scalar> a = Mat3<Scalar>::Identity();
        a(2, entry) = std::numeric_limits<Scalar>::quiet_NaN();
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
}

/// v belongs to the largest eigenvalue: the error is that of the eigenvalue, of which `share` of the largest entry is allowed.
template <typename Scalar>
void check_eigenvector(const Mat3<Scalar>& m, double share) {
    const Vec3<Scalar> v = largest_eigenvector(m);
    const Eigens<double, 3, 3> exact = eigen(m).template cast<double>();
    const Eigen::SelfAdjointEigenSolver<Eigens<double, 3, 3>> reference(exact);
    const Eigens<double, 3, 1> d = eigen(v).template cast<double>();
    EXPECT_NEAR(d.norm(), 1, 4 * std::numeric_limits<Scalar>::epsilon());
    EXPECT_LE((exact * d - reference.eigenvalues()(2) * d).norm(), share * exact.cwiseAbs().maxCoeff()) << exact;
}

TYPED_TEST(Linear, EigenvectorBelongsToTheLargestEigenvalue) {
    using Scalar = TypeParam;
    const double epsilon = std::numeric_limits<Scalar>::epsilon();
    const auto with = [&](double a, double b, double c) {
        const Eigens<double, 3, 3> axes = eigen(this->rotation()).template cast<double>().normalized().toRotationMatrix();
        const Eigens<double, 3, 3> m = axes * Eigen::Vector3d(a, b, c).asDiagonal() * axes.transpose();
        const Eigens<double, 3, 3> symmetric = 0.5 * (m + m.transpose());
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

TYPED_TEST(Linear, QuaternionsAgreeWithEigen) {
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
        const Eigen::Quaternion<Scalar> ep = eigen(p);
        expect_same(p.conjugate().coeffs(), ep.conjugate().coeffs());
        expect_near(p.toRotationMatrix(), ep.toRotationMatrix(), Mat3<Scalar>::Constant(3));
        const Mat3<Scalar> rotation = p.toRotationMatrix();
        expect_near(Quaternion<Scalar>(rotation).coeffs(),
                    Eigen::Quaternion<Scalar>(Eigens<Scalar, 3, 3>(eigen(rotation))).coeffs(), Vector4::Ones());
        expect_close<Scalar>(p.norm(), ep.norm(), 1);
        for (const auto& q : attitudes) {
            const Eigen::Quaternion<Scalar> eq = eigen(q);
            expect_near((p * q).coeffs(), (ep * eq).coeffs(), Vector4::Ones());
            expect_close<Scalar>(p.dot(q), ep.dot(eq), 1);
            if (std::abs(p.dot(q)) > Scalar(1e-3)) {  // at zero, the sign is one of rounding
                for (const Scalar t : {Scalar(0), Scalar(0.3), Scalar(1)}) {
                    expect_near(p.slerp(t, q).coeffs(), ep.slerp(t, eq).coeffs(), Vector4::Ones());
                }
            }
        }
        for (const auto& v : this->template finite<3, 1>()) {
            expect_near(p * v, ep * Eigens<Scalar, 3, 1>(eigen(v)), Vec3<Scalar>::Constant(6 * v.norm()));
        }
    }
}

TYPED_TEST(Linear, EigenSharesTheMemory) {
    using Scalar = TypeParam;
    auto columns = this->template random<3, 4>();
    Matrix<Scalar, 3, 4, Order::by_rows> rows = columns;
    EXPECT_EQ(eigen(columns).data(), columns.data());
    EXPECT_EQ(eigen(std::as_const(columns)).data(), columns.data());
    EXPECT_EQ(eigen(rows).data(), rows.data());
    EXPECT_EQ(columns.data() + 1, &columns(1, 0));
    EXPECT_EQ(rows.data() + 1, &rows(0, 1));
    expect_same(columns, rows);
    expect_same(eigen(columns), columns);
    expect_same(eigen(rows), rows);
    eigen(rows)(2, 1) = Scalar(77);
    EXPECT_EQ(rows(2, 1), Scalar(77));
    Quaternion<Scalar> q(1, 2, 3, 4);
    EXPECT_EQ(eigen(q).coeffs().data(), q.coeffs().data());
    EXPECT_EQ(eigen(q).w(), Scalar(1));
    EXPECT_EQ(eigen(q).z(), Scalar(4));
    eigen(q).x() = Scalar(9);
    EXPECT_EQ(q.x(), Scalar(9));
    const Quaternion<Scalar> back = Eigen::Quaternion<Scalar>(1, 2, 3, 4);
    expect_same(back.coeffs(), Matrix<Scalar, 4, 1>(2, 3, 4, 1));
    const Matrix<Scalar, 3, 4> from_expression = Scalar(2) * eigen(rows);
    expect_same(from_expression, rows * Scalar(2));
    const Matrix<Scalar, 3, 4, Order::by_rows> from_dynamic =
        Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>(eigen(columns));
    expect_same(from_dynamic, columns);
    expect_same(eigen(columns.row(1)), columns.row(1));
}

}  // namespace
}  // namespace tricoil
