// Error of the couplings due to the step of the converters.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Variance of an amplitude a (codes) that a lock-in measures without noise, codes squared, which the number of samples does not
/// reduce. Rounding of x adds the sum over n of (-1)^n/(pi n) sin(2 pi n x); the first term decides. Of x = a cos(wt) it changes
/// the amplitude by 2/pi J1(2 pi a) (Blachman 1985, IEEE Trans. ASSP 33(6)), and J1(z)^2 is 1/(pi z) in the mean. Below a quarter
/// of a code that form diverges.
template <typename Scalar>
Scalar rounding_variance(Scalar amplitude) {
    constexpr Scalar pi = std::numbers::pi_v<Scalar>;
    return std::min(Scalar(1) / 12, 2 / (pi * pi * pi * pi * std::abs(amplitude)));  // 1/12: of a rounded number
}

/// Standard deviation of the nine couplings x (root mean square) relative to k. steps: one code as a coupling. noise: standard
/// deviation s of a sample, codes; Gaussian noise multiplies the first term by exp(-2 (pi s)^2) in the mean (Widrow and Kollar,
/// Quantization Noise, 2008), for a fine converter by zero.
template <typename Scalar>
Scalar converter_share(const Mat3<Scalar>& x, const Mat3<Scalar>& steps, Scalar noise) {
    constexpr Scalar pi = std::numbers::pi_v<Scalar>;
    const Scalar of_noise = std::exp(-4 * pi * pi * noise * noise);
    const Scalar k_squared = x.squaredNorm() * 2 / 3;  // the singular values of X are k, k/2, k/2
    if (!(of_noise > 0 && k_squared > 0)) {
        return 0;
    }
    Scalar sum = 0;
    for (Index n = 0; n < 9; ++n) {
        const Scalar step = steps(n % 3, n / 3);
        sum += step * step * rounding_variance(x(n % 3, n / 3) / step);
    }
    return std::sqrt(of_noise * sum / 9 / k_squared);
}

}  // namespace tricoil::tracking
