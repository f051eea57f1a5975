// Phase of each sensor channel relative to the reference, estimated from couplings. A true coupling is real.
#pragma once

#include <array>
#include <complex>

#include "core/signal/column.hpp"

namespace tricoil::signal {

/// Accumulates squared complex couplings. Their phase is twice the phase of the channel, independent of the sign of the coupling.
/// One common sign of all channels remains unknown; det X > 0 determines it.
template <typename Scalar>
class PhaseCalibration {
public:
    /// Adds a column that was demodulated with unit response.
    void add(const Column<Scalar>& column) {
        for (Index coil = 0; coil < kSensorCoils; ++coil) {
            const std::complex<Scalar> coupling(column.in_phase(coil), column.quadrature(coil));
            squared_[static_cast<std::size_t>(coil)] += coupling * coupling;
        }
    }

    /// Phase (rad) per channel, each within a quarter turn of the common phase, which is in (-pi/2, pi/2].
    [[nodiscard]] std::array<Scalar, kSensorCoils> phases() const {
        const Scalar common = std::arg(squared_[0] + squared_[1] + squared_[2]) / 2;
        const std::complex<Scalar> back = std::polar(Scalar(1), -2 * common);
        std::array<Scalar, kSensorCoils> phases{};
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            phases[coil] = common + std::arg(squared_[coil] * back) / 2;
        }
        return phases;
    }

private:
    std::array<std::complex<Scalar>, kSensorCoils> squared_{};
};

}  // namespace tricoil::signal
