// Errors in units of their stated standard deviations.
#pragma once

#include <limits>

#include "core/linear/cholesky.hpp"

namespace tricoil::test {

/// e^T P^-1 e; infinite if the covariance P is not positive definite.
inline double squared_sigmas(const Vec3<double>& error, const Mat3<double>& covariance) {
    const Cholesky<double, 3> factor(covariance);
    return factor.ok() ? error.dot(factor.solve(error)) : std::numeric_limits<double>::infinity();
}

}  // namespace tricoil::test
