// Sine and cosine of a part of a turn, the same to the last bit on every processor.
#pragma once

#include <complex>

namespace tricoil::signal {

/// exp(-2 pi i part) for a part of a turn in [0, 1). Made of IEEE additions and products alone, so that a board and its
/// simulation turn alike, and a processor without double precision needs no library for it. Off by less than 3e-16.
std::complex<double> unit_phasor(double part);

}  // namespace tricoil::signal
