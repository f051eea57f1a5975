// The phase of each sensor channel against the reference, found from couplings themselves: a true coupling is real.
#pragma once

#include <array>
#include <cmath>
#include <complex>

#include "core/signal/column.hpp"

namespace tricoil::signal {

/// Accumulates squared complex couplings, whose phase is twice the channel's whatever the coupling's sign.
/// What remains open is one common sign, that of all channels together; det X > 0 settles it.
template <typename Scalar>
class PhaseCalibration {
public:
    /// Takes a column that was demodulated with unit response.
    void add(const Column<Scalar>& column) {
        for (Eigen::Index coil = 0; coil < kSensorCoils; ++coil) {
            const std::complex<Scalar> coupling(column.in_phase(coil), column.quadrature(coil));
            squared_[static_cast<std::size_t>(coil)] += coupling * coupling;
        }
    }

    /// Phase (rad) per channel, each within a quarter turn of the common phase, which lies in (-pi/2, pi/2].
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
