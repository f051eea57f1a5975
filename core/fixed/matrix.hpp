// Fixed-point numbers in fixed-size Eigen matrices, and matrix products that are rounded only once.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "core/fixed/fixed.hpp"
#include "core/geometry/types.hpp"

namespace Eigen {

template <int F>
struct NumTraits<tricoil::fixed::Fixed<F>> : GenericNumTraits<tricoil::fixed::Fixed<F>> {
    using Self = tricoil::fixed::Fixed<F>;
    using Real = Self;
    using NonInteger = Self;
    using Nested = Self;
    // NOLINTNEXTLINE(readability-identifier-naming): names that Eigen requires
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 1, AddCost = 4, MulCost = 8 };
    static Self epsilon() { return Self::from_raw(1); }
    static Self dummy_precision() { return Self::from_raw(4); }
    static Self highest() { return Self::largest(); }
    static Self lowest() { return Self::smallest(); }
    static int digits10() { return 9; }
};

}  // namespace Eigen

namespace tricoil::fixed {

/// a . b in format Out, rounded once. The sum of three products may exceed 64 bits; it then saturates, and so does the result.
/// (Two products exceed 64 bits only in one case, the sum 2^63.)
template <int Out, typename A, typename B>
Fixed<Out> dot(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
    constexpr int kBits = A::Scalar::kFractionBits + B::Scalar::kFractionBits - Out;
    static_assert(A::SizeAtCompileTime == 3 && B::SizeAtCompileTime == 3 && kBits >= 0 && kBits <= 31);  // 2^63 saturates
    std::int64_t sum = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
        const std::int64_t product = std::int64_t{a(i).raw()} * b(i).raw();
        if (__builtin_add_overflow(sum, product, &sum)) {
            sum = product > 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
        }
    }
    return Fixed<Out>::from_raw(saturate(shift_right_rounded(sum, kBits)));
}

/// Product a b with inner dimension three; each entry is computed by dot().
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

/// a x b in format Out. Differences of two products fit in 64 bits: the largest is 2^63 - 2^31.
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
