// Fixed-point numbers in fixed-size Eigen matrices, and products of such that are rounded once instead of at every term.
#pragma once

#include <Eigen/Core>

#include "core/fixed/fixed.hpp"
#include "core/geometry/types.hpp"

namespace Eigen {

template <int F>
struct NumTraits<tricoil::fixed::Fixed<F>> : GenericNumTraits<tricoil::fixed::Fixed<F>> {
    using Self = tricoil::fixed::Fixed<F>;
    using Real = Self;
    using NonInteger = Self;
    using Nested = Self;
    // NOLINTNEXTLINE(readability-identifier-naming): Eigen's names
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 1, AddCost = 4, MulCost = 8 };
    static Self epsilon() { return Self::from_raw(1); }
    static Self dummy_precision() { return Self::from_raw(4); }
    static Self highest() { return Self::largest(); }
    static Self lowest() { return Self::smallest(); }
    static int digits10() { return 9; }
};

}  // namespace Eigen

namespace tricoil::fixed {

/// a . b in format Out. The sum of three products of 31 bits needs 64: exact as long as every |a_i b_i| is below 2^61 units,
/// which each use states in its range analysis.
template <int Out, typename A, typename B>
Fixed<Out> dot(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
    constexpr int kBits = A::Scalar::kFractionBits + B::Scalar::kFractionBits - Out;
    static_assert(A::SizeAtCompileTime == 3 && B::SizeAtCompileTime == 3 && kBits >= 0);
    std::int64_t sum = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
        sum += std::int64_t{a(i).raw()} * b(i).raw();
    }
    return Fixed<Out>::from_raw(saturate(shift_right_rounded(sum, kBits)));
}

/// a b for three rows or columns between, by dot().
template <int Out, typename A, typename B>
Eigen::Matrix<Fixed<Out>, A::RowsAtCompileTime, B::ColsAtCompileTime> multiply(const Eigen::MatrixBase<A>& a,
                                                                               const Eigen::MatrixBase<B>& b) {
    static_assert(A::ColsAtCompileTime == 3 && B::RowsAtCompileTime == 3);
    Eigen::Matrix<Fixed<Out>, A::RowsAtCompileTime, B::ColsAtCompileTime> result;
    for (Eigen::Index i = 0; i < result.rows(); ++i) {
        for (Eigen::Index j = 0; j < result.cols(); ++j) {
            result(i, j) = dot<Out>(a.row(i), b.col(j));
        }
    }
    return result;
}

/// a x b in format Out; |a_i b_j| below 2^61 units.
template <int Out, typename A, typename B>
Vec3<Fixed<Out>> cross(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
    constexpr int kBits = A::Scalar::kFractionBits + B::Scalar::kFractionBits - Out;
    const auto term = [&](Eigen::Index i, Eigen::Index j) {
        const std::int64_t difference = std::int64_t{a(i).raw()} * b(j).raw() - std::int64_t{a(j).raw()} * b(i).raw();
        return Fixed<Out>::from_raw(saturate(shift_right_rounded(difference, kBits)));
    };
    return {term(1, 2), term(2, 0), term(0, 1)};
}

}  // namespace tricoil::fixed
