// Random and awkward matrices, and comparison of core/linear with Eigen. Eigen's side has dynamic sizes, so it is compiled once
// for each scalar and not for each shape.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/linear/quaternion.hpp"

namespace tricoil {

template <typename Scalar>
using Oracle = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

template <typename D>
Oracle<typename D::Scalar> oracle(const Dense<D>& m) {
    Oracle<typename D::Scalar> copy(m.rows(), m.cols());
    for (int i = 0; i < m.rows(); ++i) {
        for (int j = 0; j < m.cols(); ++j) {
            copy(i, j) = m(i, j);
        }
    }
    return copy;
}

inline bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// Bit for bit, except for the kind of NaN.
template <typename D>
void expect_same(const Dense<D>& m, const Oracle<typename D::Scalar>& expected) {
    const auto a = oracle(m);
    ASSERT_EQ(a.rows(), expected.rows());
    ASSERT_EQ(a.cols(), expected.cols());
    for (Index n = 0; n < a.size(); ++n) {
        EXPECT_TRUE(same(a(n), expected(n))) << a(n) << " instead of " << expected(n) << " at " << n;
    }
}
template <typename A, typename B>
void expect_same(const Dense<A>& a, const Dense<B>& b) {
    expect_same(a, oracle(b));
}

constexpr double kUnits = 8;  // in the last place; a sum of twelve terms, twice

template <typename Scalar>
void expect_close(Scalar a, Scalar expected, Scalar absolute_terms, double units = kUnits) {
    if (!std::isfinite(expected)) {
        EXPECT_TRUE(same(a, expected)) << a << " instead of " << expected;
        return;
    }
    using Range = std::numeric_limits<Scalar>;
    const double tolerance = units * (Range::epsilon() * static_cast<double>(absolute_terms) + Range::denorm_min());
    EXPECT_LE(std::abs(static_cast<double>(a) - expected), tolerance) << a << " instead of " << expected;
}

/// Within a few units in the last place of the sum of the absolute terms.
template <typename D>
void expect_near(const Dense<D>& m, const Oracle<typename D::Scalar>& expected, const Oracle<typename D::Scalar>& absolute_terms,
                 double units = kUnits) {
    const auto a = oracle(m);
    ASSERT_EQ(a.rows(), expected.rows());
    ASSERT_EQ(a.cols(), expected.cols());
    for (Index n = 0; n < a.size(); ++n) {
        expect_close(a(n), expected(n), absolute_terms(n), units);
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

private:
    std::mt19937_64 random_{17};
    std::normal_distribution<double> normal_;
};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Linear, Scalars);

}  // namespace tricoil
