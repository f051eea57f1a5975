// Sine and cosine of a part of a turn, the same to the last bit on every processor.
#pragma once

#include <cmath>
#include <complex>
#include <numbers>

namespace tricoil::signal {

/// exp(-2 pi i part) for a part of a turn in [0, 1). Made of IEEE additions and products alone, so that a board and its
/// simulation turn alike, and a processor without double precision needs no library for it. Off by less than 3e-16.
inline std::complex<double> unit_phasor(double part) {
    const auto quarters = static_cast<int>(4 * part + 0.5);
    const double x = 2 * std::numbers::pi * (part - 0.25 * quarters);  // within an eighth of a turn
    const double square = x * x;
    double sine = 1;
    double cosine = 1;
    for (int n = 8; n > 0; --n) {  // Taylor, innermost factor first; the next term is below 1e-17
        sine = 1 - square / (2 * n * (2 * n + 1)) * sine;
        cosine = 1 - square / (2 * n * (2 * n - 1)) * cosine;
    }
    sine *= x;
    switch (quarters % 4) {
        case 0:
            return {cosine, -sine};
        case 1:
            return {-sine, -cosine};
        case 2:
            return {-cosine, sine};
        default:
            return {sine, cosine};
    }
}

}  // namespace tricoil::signal
