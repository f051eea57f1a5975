// Fixed-point numbers in matrices: products that are rounded only once.
#pragma once

#include <limits>

#include "core/fixed/fixed.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::fixed {

/// a . b in format Out, rounded once. The sum of three products may exceed 64 bits; it then saturates, and so does the result.
/// (Two products exceed 64 bits only in one case, the sum 2^63.)
template <int Out, typename A, typename B>
Fixed<Out> dot(const Dense<A>& a, const Dense<B>& b) {
    constexpr int kBits = A::Scalar::kFractionBits + B::Scalar::kFractionBits - Out;
    static_assert(A::kSize == 3 && B::kSize == 3 && kBits >= 0 && kBits <= 31);  // 2^63 saturates
    std::int64_t sum = 0;
#pragma GCC unroll 3
    for (Index i = 0; i < 3; ++i) {
        const std::int64_t product = std::int64_t{a(i).raw()} * b(i).raw();
        if (__builtin_add_overflow(sum, product, &sum)) {
            sum = product > 0 ? std::numeric_limits<std::int64_t>::max() : std::numeric_limits<std::int64_t>::min();
        }
    }
    return Fixed<Out>::from_raw(saturate(shift_right_rounded(sum, kBits)));
}

/// a . b with the fraction bits of both, exact. It must fit into 64 bits.
template <typename A, typename B>
std::int64_t exact_dot(const Dense<A>& a, const Dense<B>& b) {
    static_assert(A::kSize == B::kSize);
    std::int64_t sum = 0;
    for (Index i = 0; i < A::kSize; ++i) {
        sum += std::int64_t{a(i).raw()} * b(i).raw();
    }
    return sum;
}

/// Product a b with inner dimension three; each entry is computed by dot().
template <int Out, typename A, typename B>
Matrix<Fixed<Out>, A::kRows, B::kColumns> multiply(const Dense<A>& a, const Dense<B>& b) {
    static_assert(A::kColumns == 3 && B::kRows == 3);
    Matrix<Fixed<Out>, A::kRows, B::kColumns> result;
    for (Index i = 0; i < result.rows(); ++i) {
        for (Index j = 0; j < result.cols(); ++j) {
            result(i, j) = dot<Out>(a.row(i), b.col(j));
        }
    }
    return result;
}

/// a x b in format Out. Differences of two products fit in 64 bits: the largest is 2^63 - 2^31.
template <int Out, typename A, typename B>
Vec3<Fixed<Out>> cross(const Dense<A>& a, const Dense<B>& b) {
    constexpr int kBits = A::Scalar::kFractionBits + B::Scalar::kFractionBits - Out;
    const auto term = [&](Index i, Index j) {
        const std::int64_t difference = std::int64_t{a(i).raw()} * b(j).raw() - std::int64_t{a(j).raw()} * b(i).raw();
        return Fixed<Out>::from_raw(saturate(shift_right_rounded(difference, kBits)));
    };
    return {term(1, 2), term(2, 0), term(0, 1)};
}

}  // namespace tricoil::fixed
