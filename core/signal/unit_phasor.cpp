#include "core/signal/unit_phasor.hpp"

#include <numbers>

namespace tricoil::signal {

std::complex<double> unit_phasor(double part) {
    const auto quarters = static_cast<int>(4 * part + 0.5);
    const double x = 2 * std::numbers::pi * (part - 0.25 * quarters);  // within an eighth of a turn
    const double square = x * x;
    double sine = 1;
    double cosine = 1;
    for (int n = 8; n > 0; --n) {  // Taylor series, innermost factor first; the next term is below 1e-17
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
