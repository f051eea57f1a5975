// Error of the couplings due to the step of the converters.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Variance of an amplitude a (codes) that a lock-in measures, codes squared, which the number of samples does not reduce.
/// noise: standard deviation s of a sample, codes. Rounding of x adds the sum over n of (-1)^n/(pi n) sin(2 pi n x). Gaussian
/// noise multiplies each term by exp(-2 (pi n s)^2) in the mean (Widrow and Kollar, Quantization Noise, 2008), so the first one
/// decides. Of x = a cos(wt) it changes the amplitude by 2/pi J1(2 pi a) (Blachman 1985, IEEE Trans. ASSP 33(6)), and J1(z)^2 is
/// 1/(pi z) in the mean. Below a quarter of a code that form diverges.
template <typename Scalar>
Scalar rounding_variance(Scalar amplitude, Scalar noise) {
    const Scalar pi_squared = std::numbers::pi_v<Scalar> * std::numbers::pi_v<Scalar>;
    const Scalar mean =
        std::min(Scalar(1) / 12, 2 / (pi_squared * pi_squared * std::abs(amplitude)));  // 1/12: of a rounded number
    return mean * std::exp(-4 * pi_squared * noise * noise);
}

/// Standard deviation of the nine couplings x (root mean square) relative to k. steps: one code as a coupling.
template <typename Scalar>
Scalar converter_share(const Mat3<Scalar>& x, const Mat3<Scalar>& steps, Scalar noise) {
    Scalar sum = 0;
    for (Index n = 0; n < 9; ++n) {
        const Scalar step = steps(n % 3, n / 3);
        sum += step * step * rounding_variance(x(n % 3, n / 3) / step, noise);
    }
    const Scalar k_squared = x.squaredNorm() * 2 / 3;  // the singular values of X are k, k/2, k/2
    return k_squared > 0 ? std::sqrt(sum / 9 / k_squared) : Scalar(0);
}

}  // namespace tricoil::tracking
