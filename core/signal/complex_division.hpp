// Division of phasors by quantities that are far from zero and from overflow.
#pragma once

#include <complex>

namespace tricoil::signal {

/// a / b for |b|^2 within the range of Scalar. The language's own division also serves extreme b, for which compilers compute in
/// twice the precision: ten times the instructions on a part without double precision in hardware.
template <typename Scalar>
std::complex<Scalar> divide(const std::complex<Scalar>& a, const std::complex<Scalar>& b) {
    const Scalar scale = 1 / (b.real() * b.real() + b.imag() * b.imag());
    return {(a.real() * b.real() + a.imag() * b.imag()) * scale, (a.imag() * b.real() - a.real() * b.imag()) * scale};
}

}  // namespace tricoil::signal
