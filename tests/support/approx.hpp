// Comparison of matrices.
#pragma once

#include <algorithm>

#include "core/linear/matrix.hpp"

namespace tricoil {

/// Equal within `tolerance` times the smaller of the two Frobenius norms.
template <typename A, typename B>
constexpr bool is_approx(const Dense<A>& a, const Dense<B>& b, double tolerance = 1e-12) {
    return (a - b).squaredNorm() <= tolerance * tolerance * std::min(a.squaredNorm(), b.squaredNorm());
}

}  // namespace tricoil
