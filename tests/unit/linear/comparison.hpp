// Random and awkward matrices, and comparison of core/linear with Eigen.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/linear/quaternion.hpp"
#include "tests/unit/linear/oracle.hpp"

namespace tricoil {

template <typename D>
Oracle oracle(const Dense<D>& m) {
    return Oracle(m);
}
template <typename Scalar>
Oracle oracle(const Quaternion<Scalar>& q) {
    return Oracle(q.coeffs());
}
inline const Oracle& oracle(const Oracle& m) { return m; }

inline void expect_same_shape(const Oracle& a, const Oracle& expected) {
    ASSERT_EQ(a.rows(), expected.rows());
    ASSERT_EQ(a.cols(), expected.cols());
}

/// Bit for bit, except for the kind of NaN.
inline bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

inline void expect_same_entries(const Oracle& a, const Oracle& expected) {
    expect_same_shape(a, expected);
    for (Index n = 0; n < expected.size(); ++n) {
        EXPECT_TRUE(same(a(n), expected(n))) << a(n) << " instead of " << expected(n) << " at " << n;
    }
}
template <typename M, typename E>
void expect_same(const M& m, const E& expected) {
    const bool single = std::is_same_v<typename M::Scalar, float>;
    expect_same_entries(oracle(m), single ? oracle(expected).in_float() : oracle(expected));
}

constexpr double kUnits = 8;  // in the last place; a sum of twelve terms, twice

struct Resolution {
    double epsilon;
    double smallest;
};
template <typename Scalar>
constexpr Resolution kResolution{std::numeric_limits<Scalar>::epsilon(), std::numeric_limits<Scalar>::denorm_min()};

inline void expect_within(double a, double expected, double absolute_terms, double units, const Resolution& resolution) {
    if (!std::isfinite(expected)) {
        EXPECT_TRUE(same(a, expected)) << a << " instead of " << expected;
        return;
    }
    EXPECT_LE(std::abs(a - expected), units * (resolution.epsilon * absolute_terms + resolution.smallest))
        << a << " instead of " << expected;
}

/// Within a few units in the last place of the sum of the absolute terms.
template <typename Scalar>
void expect_close(Scalar a, double expected, double absolute_terms) {
    expect_within(double{a}, expected, absolute_terms, kUnits, kResolution<Scalar>);
}
template <typename M>
void expect_near(const M& m, const Oracle& expected, const Oracle& absolute_terms, double units = kUnits) {
    const Oracle a = oracle(m);
    expect_same_shape(a, expected);
    for (Index n = 0; n < expected.size(); ++n) {
        expect_within(a(n), expected(n), absolute_terms(n), units, kResolution<typename M::Scalar>);
    }
}

template <typename Scalar>
class Linear : public ::testing::Test {
protected:
    using Limits = std::numeric_limits<Scalar>;

    template <int Rows, int Columns>
    Matrix<Scalar, Rows, Columns> random(double size = 1) {
        Matrix<Scalar, Rows, Columns> m;
        for (Scalar& entry : m) {
            entry = static_cast<Scalar>(size * normal_(random_));
        }
        return m;
    }
    Quaternion<Scalar> rotation() { return Quaternion<Scalar>(random<4, 1>().normalized()); }

    /// Random, zero, singular, very small and denormal.
    template <int Rows, int Columns>
    std::vector<Matrix<Scalar, Rows, Columns>> finite() {
        using M = Matrix<Scalar, Rows, Columns>;
        std::vector<M> all{M::Zero(), M::Ones(), M::Constant(Limits::denorm_min()), M::Constant(-Limits::min())};
        for (const double size : {1.0, 1.0, 1.0, 1e-3, 1e3, 1e-12, 1e12}) {
            all.push_back(random<Rows, Columns>(size));
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

}  // namespace tricoil
