// The world in front of the converters: three source coils, a moving sensor, and everything that spoils its signals.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/demodulator.hpp"
#include "sim/motion/motion.hpp"
#include "sim/world/coil_circuit.hpp"
#include "sim/world/converter.hpp"
#include "sim/world/fault.hpp"

namespace tricoil::sim {

struct WorldParams {
    double coupling_constant_m3 = 6.75e-3;  // C: 2 V at 0.15 m for 1 V of reference
    double coil_resistance_ohm = 10;
    double coil_inductance_h = 300e-6;                      // L/R = 30 us
    Mat3<double> source_matrix = Mat3<double>::Identity();  // G_source: gain mismatch and non-orthogonality, column per coil
    Mat3<double> sensor_matrix = Mat3<double>::Identity();  // G_sensor: row per coil
    std::array<double, kSensorCoils> channel_gain{1, 1, 1};
    std::array<double, kSensorCoils> channel_phase_rad{0.01, -0.02, 0.015};  // of the amplifiers, beyond the coil's quarter turn
    double mains_v = 1e-3;  // amplitude of the fundamental; its third and fifth harmonics are 1/3 and 1/5
    double mains_hz = 50;
    double crosstalk = 0.02;  // of the drive into open inputs, when the sensor is unplugged
    ConverterParams converter;
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the parameter when one cannot describe a world (bits outside 8-31, a matrix that is
/// singular, ...).
void check(const WorldParams& params);

/// Evaluates the dipole field, circuits and converters for every single ADC sample, so that motion within a window is real.
class CoilWorld {
public:
    /// `motion` must outlive the world. Deterministic: equal parameters and calls give equal samples.
    CoilWorld(const WorldParams& params, const Motion& motion, std::vector<Fault> faults);

    /// Sets carriers and rates. TDM drives each coil with amplitude 1; FDM with half of that and in inverse proportion to the
    /// carrier, so that all three couplings have equal noise and the sum stays in range. Carriers are phased so that the currents
    /// peak in the middle of the window: a linear change of one coupling then leaks into the others' quadrature only.
    void configure(const signal::AcquisitionPlan& plan);

    /// From now on an amplifier stands before the converters of the sensor's channels.
    void amplify(const signal::GainStep<double>& amplifier);

    /// Fills `samples` from `start_s` on; false if the faults lose this block (the time passes all the same).
    bool sample(Excitation state, double start_s, std::span<Sample> samples);

    /// What a demodulator must know of these channels: gains and phases calibrated perfectly, the converter's quantisation as a
    /// floor of every sigma (in force without noise too), and how far the amplifiers are linear.
    [[nodiscard]] signal::DemodulatorParams<double> demodulation() const;

    /// Standard deviation of one coupling entry that the converters' noise makes, both demodulated parts taken alike.
    [[nodiscard]] double coupling_sigma() const;

    /// X at a pose, in this world's faultless units.
    [[nodiscard]] Mat3<double> coupling(const Pose& pose) const;
    /// X at a pose under faults; currents are not part of it.
    [[nodiscard]] Mat3<double> coupling(const Pose& pose, const FaultEffect& effect) const;

    [[nodiscard]] const WorldParams& params() const { return params_; }
    [[nodiscard]] double volts_per_code() const { return converters_.front().volts_per_code(); }
    [[nodiscard]] std::int32_t full_scale() const { return converters_.front().full_scale(); }

private:
    [[nodiscard]] double drive_amplitude(int j) const;
    [[nodiscard]] signal::ChannelResponse<double> channel_response() const;
    [[nodiscard]] Vec3<double> amplified(const Mat3<double>& x, const Mat3<double>& dx, const Vec3<std::complex<double>>& current,
                                         const Vec3<std::complex<double>>& derivative) const;
    Sample convert(const Vec3<double>& sensor_v, double reference_v, double time_s, const FaultEffect& effect);

    WorldParams params_;
    const Motion& motion_;
    std::vector<Fault> faults_;
    signal::AcquisitionPlan plan_;
    std::array<CoilCircuit, kSourceCoils> circuits_;
    std::vector<Converter> converters_;  // one a channel
    std::vector<double> mains_;          // one period, if it is a whole number of samples; else empty
    std::array<std::complex<double>, kSensorCoils> channel_;
    std::optional<signal::GainStep<double>> amplifier_;
    signal::ChannelResponse<double> amplification_ = signal::unit_response<double>();  // at the carriers
    std::mt19937_64 random_;
    std::mt19937_64 drop_random_;
};

}  // namespace tricoil::sim
