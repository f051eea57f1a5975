// Products and quotients of phasors whose magnitudes are far from overflow.
#pragma once

#include <complex>

namespace tricoil::signal {

/// a b. The product of std::complex also checks for infinities in every NaN result.
template <typename Scalar>
std::complex<Scalar> multiply(const std::complex<Scalar>& a, const std::complex<Scalar>& b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// a / b for |b|^2 within the range of Scalar. The quotient of std::complex also supports extreme b, for which compilers use
/// double the precision: ten times the instructions on a processor without double-precision FPU.
template <typename Scalar>
std::complex<Scalar> divide(const std::complex<Scalar>& a, const std::complex<Scalar>& b) {
    const Scalar scale = 1 / (b.real() * b.real() + b.imag() * b.imag());
    return {(a.real() * b.real() + a.imag() * b.imag()) * scale, (a.imag() * b.real() - a.real() * b.imag()) * scale};
}

}  // namespace tricoil::signal
