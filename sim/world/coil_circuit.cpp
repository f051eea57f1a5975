#include "sim/world/coil_circuit.hpp"

#include <cmath>

namespace tricoil::sim {
namespace {

constexpr double kNegligible = 1e-15;  // relative to the nominal current; smaller values would decay into slow denormal numbers

}  // namespace

CoilCircuit::CoilCircuit(double amplitude, double carrier_rad_s, double phase_rad, double time_constant_s, double reference_rad_s)
    : amplitude_(amplitude),
      carrier_rad_s_(carrier_rad_s),
      phase_rad_(phase_rad),
      time_constant_s_(time_constant_s),
      reference_rad_s_(reference_rad_s) {}

void CoilCircuit::begin_block(double time_s, double sample_s, bool on) {
    phasor_ = std::polar(1.0, std::remainder(carrier_rad_s_ * time_s + phase_rad_, 2 * M_PI));
    step_ = std::polar(1.0, carrier_rad_s_ * sample_s);
    transient_ = std::abs(transient_) < kNegligible ? 0 : transient_;
    decay_ = std::exp(-sample_s / time_constant_s_);
    if (on != on_) {
        const double steady = amplitude_ * phasor_.real();
        transient_ += on ? -steady : steady;  // the current is continuous
        on_ = on;
    }
}

CoilCurrent CoilCircuit::next() {
    const std::complex<double> steady = on_ ? amplitude_ * phasor_ : 0.0;
    const std::complex<double> rotated = std::complex<double>(0, carrier_rad_s_ / reference_rad_s_) * steady;
    const CoilCurrent now{steady + transient_, rotated - transient_ / (time_constant_s_ * reference_rad_s_)};
    phasor_ *= step_;
    transient_ *= decay_;
    return now;
}

}  // namespace tricoil::sim
