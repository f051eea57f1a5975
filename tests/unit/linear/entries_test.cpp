// Operations on single entries have the same bits as Eigen's.
#include <complex>

#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearEntries : public Linear<Scalar> {
protected:
    static constexpr int kRows = 3;
    static constexpr int kColumns = std::is_same_v<Scalar, float> ? 3 : 12;  // in double, assignments are loops

    auto any() { return Linear<Scalar>::template any<kRows, kColumns>(); }
    auto finite() { return Linear<Scalar>::template finite<kRows, kColumns>(); }
};
TYPED_TEST_SUITE(LinearEntries, Scalars);

TYPED_TEST(LinearEntries, OfOneMatrixHaveTheSameBits) {
    using Scalar = TypeParam;
    for (const auto& a : this->any()) {
        const Oracle ea = oracle(a);
        const auto expect_both = [&](auto f) { expect_same(f(a), f(ea)); };
        expect_both([](const auto& m) { return -m; });
        expect_both([](const auto& m) { return m * Scalar(0.3); });
        expect_both([](const auto& m) { return m / Scalar(0.3); });
        expect_both([](const auto& m) { return m.cwiseAbs(); });
        expect_both([](const auto& m) { return m.cwiseAbs2(); });
        expect_both([](const auto& m) { return m.cwiseInverse(); });
        expect_both([](const auto& m) { return m.cwiseAbs().cwiseSqrt(); });
        expect_both([](const auto& m) { return m.transpose(); });
        expect_same(Scalar(0.3) * a, ea * Scalar(0.3));
        expect_same(a.template cast<float>(), ea.in_float());
        auto changed = a;
        expect_same(changed *= Scalar(3), ea * Scalar(3));
        changed = a;
        expect_same(changed /= Scalar(11), ea / Scalar(11));
        EXPECT_TRUE(a == a || !(ea == ea));
        EXPECT_EQ(a.allFinite(), ea.allFinite());
        for (const Scalar tolerance : {Scalar(0), Scalar(1e-3), Scalar(10)}) {
            EXPECT_EQ(a.isZero(tolerance), ea.isZero(tolerance));
        }
        EXPECT_EQ(a.all([](Scalar x) { return x > -1; }), a.allFinite() && ea.minCoeff() > -1);
    }
}

TYPED_TEST(LinearEntries, OfTwoMatricesHaveTheSameBits) {
    using Scalar = TypeParam;
    const auto all = this->any();
    for (const auto& a : all) {
        const Oracle ea = oracle(a);
        for (const auto& b : all) {
            const Oracle eb = oracle(b);
            const auto expect_both = [&](auto f) { expect_same(f(a, b), f(ea, eb)); };
            expect_both([](const auto& m, const auto& n) { return m + n; });
            expect_both([](const auto& m, const auto& n) { return m - n; });
            expect_both([](const auto& m, const auto& n) { return m.cwiseProduct(n); });
            expect_both([](const auto& m, const auto& n) { return m.cwiseQuotient(n); });
            auto changed = a;
            expect_same(changed += b, ea + eb);
            changed = a;
            expect_same(changed -= b, ea - eb);
            EXPECT_EQ(a == b, ea == eb);
        }
    }
    for (const auto& a : this->finite()) {
        const auto b = this->template random<TestFixture::kRows, TestFixture::kColumns>();
        const Oracle ea = oracle(a);
        const Oracle half = Oracle::Constant(a.rows(), a.cols(), 0.5);
        expect_same(a.cwiseMax(b), ea.cwiseMax(oracle(b)));
        expect_same(a.cwiseMin(b), ea.cwiseMin(oracle(b)));
        expect_same(a.cwiseMax(Scalar(0.5)), ea.cwiseMax(half));
        expect_same(a.cwiseMin(Scalar(0.5)), ea.cwiseMin(half));
        EXPECT_EQ(a.maxCoeff(), ea.maxCoeff());
        EXPECT_EQ(a.minCoeff(), ea.minCoeff());
    }
}

TYPED_TEST(LinearEntries, ExtremesAreAtTheSameIndex) {
    using Column = Matrix<TypeParam, 5, 1>;
    std::vector<Column> columns{Column::Ones(), {1, 3, 3, 0, 0}, {0, -1, 5, -1, 5}};
    for (int n = 0; n < 20; ++n) {
        columns.push_back(this->template random<5, 1>());
    }
    for (const auto& a : columns) {
        Index largest = -1;
        Index smallest = -1;
        Index expected = -1;
        EXPECT_EQ(a.maxCoeff(&largest), oracle(a).maxCoeff(&expected));
        EXPECT_EQ(largest, expected);
        EXPECT_EQ(a.minCoeff(&smallest), oracle(a).minCoeff(&expected));
        EXPECT_EQ(smallest, expected);
    }
}

TYPED_TEST(LinearEntries, ConstantsAreEigens) {
    using Scalar = TypeParam;
    using M = Matrix<Scalar, 3, 4>;
    const Oracle identity = Oracle::Identity(3, 4);
    M m;
    for (const Scalar value : {Scalar(0), Scalar(1), Scalar(-7)}) {
        expect_same(M::Constant(value), Oracle::Constant(3, 4, value));
        expect_same(m.setConstant(value), Oracle::Constant(3, 4, value));
    }
    expect_same(M::Zero(), Oracle::Constant(3, 4, 0));
    expect_same(m.setZero(), Oracle::Constant(3, 4, 0));
    expect_same(M::Ones(), Oracle::Constant(3, 4, 1));
    expect_same(M::Identity(), identity);
    expect_same(m.setIdentity(), identity);
    for (Index k = 0; k < 5; ++k) {
        expect_same(Matrix<Scalar, 5, 1>::Unit(k), Oracle::Unit(5, k));
    }
    expect_same(Vec3<Scalar>::UnitX(), Oracle::Unit(3, 0));
    expect_same(Vec3<Scalar>::UnitY(), Oracle::Unit(3, 1));
    expect_same(Vec3<Scalar>::UnitZ(), Oracle::Unit(3, 2));
    for (const Scalar error : {Scalar(0), Scalar(0.01), Scalar(-0.01), std::numeric_limits<Scalar>::quiet_NaN()}) {
        for (int entry : {0, 1, 8}) {
            Mat3<Scalar> near = Mat3<Scalar>::Identity();
            near(entry) += error;
            EXPECT_EQ(near.isIdentity(Scalar(0.02)), oracle(near).isIdentity(0.02));
            EXPECT_EQ(near.isIdentity(Scalar(0.005)), oracle(near).isIdentity(0.005));
        }
    }
}

TYPED_TEST(LinearEntries, FunctionsSetEntries) {
    using Scalar = TypeParam;
    using M = Matrix<Scalar, 2, 3>;
    Scalar successive = 0;
    expect_same(M::NullaryExpr([&] { return successive += 1; }).reshaped(), Matrix<Scalar, 6, 1>(1, 2, 3, 4, 5, 6));
    const M real = this->template random<2, 3>();
    const M imaginary = this->template random<2, 3>();
    const auto complex = Matrix<std::complex<Scalar>, 2, 3>::NullaryExpr(
        [&](int i, int j) { return std::complex<Scalar>(real(i, j), imaginary(i, j)); });
    expect_same(complex.real(), real);
    expect_same(complex.imag(), imaginary);
}

}  // namespace
}  // namespace tricoil
