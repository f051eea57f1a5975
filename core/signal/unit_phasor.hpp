// Sine and cosine of a fraction of a turn, bit-identical on every processor.
#pragma once

#include <complex>

namespace tricoil::signal {

/// exp(-2 pi i part) for `part` of a turn in [0, 1). Uses only IEEE sums, products and quotients, so a board and its simulation
/// give identical results, and processors without double precision need no library function. Error below 3e-16.
std::complex<double> unit_phasor(double part);

}  // namespace tricoil::signal
