// One source coil and its drive: a carrier in steady state plus the switching transient.
#pragma once

#include <complex>

namespace tricoil::sim {

/// Current divided by the nominal current, and its rate of change divided by the reference angular frequency (so that a steady
/// carrier at that frequency has a derivative of the same size). The imaginary parts carry the quadrature for channels with a
/// phase error.
struct CoilCurrent {
    std::complex<double> current;
    std::complex<double> derivative;
};

/// A series R-L circuit, solved exactly: the current is continuous when the drive changes, and its difference from the new steady
/// state decays with the time constant L/R.
class CoilCircuit {
public:
    CoilCircuit() = default;

    /// Steady state: amplitude cos(w t + phase); time_constant_s = L/R.
    CoilCircuit(double amplitude, double carrier_rad_s, double phase_rad, double time_constant_s, double reference_rad_s);

    /// Advances to `time_s` and switches the drive on or off at that time. Call it at the start of every block.
    void begin_block(double time_s, double sample_s, bool on);

    /// After a long pause: the drive is off and the current has decayed.
    void rest() {
        on_ = false;
        transient_ = 0;
    }

    /// Current at the present sample; advances to the next sample.
    CoilCurrent next();

private:
    double amplitude_ = 0;
    double carrier_rad_s_ = 0;
    double phase_rad_ = 0;
    double time_constant_s_ = 1;
    double reference_rad_s_ = 1;
    bool on_ = false;
    double transient_ = 0;
    double decay_ = 0;                   // of the transient per sample
    std::complex<double> phasor_{1, 0};  // exp(i (w t + phase))
    std::complex<double> step_{1, 0};
};

}  // namespace tricoil::sim
