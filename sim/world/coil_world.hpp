// The simulated world: three source coils, a moving sensor, all disturbances of its signals, and the converters.
#pragma once

#include <array>
#include <cstdint>
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
#include "sim/world/metal/metal_set.hpp"
#include "sim/world/metal_track.hpp"

namespace tricoil::sim {

struct WorldParams {
    double coupling_constant_m3 = 6.75e-3;  // C: 2 V at 0.15 m for 1 V of reference
    double coil_resistance_ohm = 10;
    double coil_inductance_h = 300e-6;                      // L/R = 30 us
    Mat3<double> source_matrix = Mat3<double>::Identity();  // G_source: gain mismatch and non-orthogonality, one column per coil
    Mat3<double> sensor_matrix = Mat3<double>::Identity();  // G_sensor: one row per coil
    Mat3<double> pick_up = Mat3<double>::Zero();            // couplings that do not come from the sensor
    std::array<double, kSensorCoils> channel_gain{1, 1, 1};
    std::array<double, kSensorCoils> channel_phase_rad{0.01, -0.02,
                                                       0.015};  // of the amplifiers, in addition to the coil's 90 degrees
    double mains_v = 1e-3;  // amplitude of the fundamental; its third and fifth harmonics are 1/3 and 1/5
    double mains_hz = 50;
    double crosstalk = 0.02;  // from the drive into the open inputs of an unplugged sensor
    ConverterParams converter;
    std::uint64_t seed = 1;
};

/// Throws std::invalid_argument naming the parameter if a parameter is invalid (bits outside 8-31, a singular matrix, ...).
void check(const WorldParams& params);

/// Computes the dipole field, circuits and converters for every ADC sample, so that motion within a window has its true effect.
class CoilWorld {
public:
    /// `motion` must outlive the world. Deterministic: equal parameters and calls give equal samples.
    CoilWorld(const WorldParams& params, const Motion& motion, std::vector<Fault> faults);

    /// Sets carriers and rates. TDM drives each coil with amplitude 1. In FDM the amplitude is 0.5 at 10 kHz and inversely
    /// proportional to the carrier frequency, so that all three couplings have equal noise and the sum stays in range. Low
    /// carriers have 0.25 at 720 Hz by the same rule: a coil's voltage grows with the frequency, so their noise is 28 times that
    /// of the high carriers. The carrier phases make the currents peak in the middle of the window: then a linear change of one
    /// coupling leaks only into the quadrature of the others.
    void configure(const signal::AcquisitionPlan& plan);

    /// Puts an amplifier before the converters of the sensor channels, or changes it.
    void amplify(const signal::GainStep<double>& amplifier);

    /// Fills `samples` from `start_s` on. False if a fault drops this block (time advances as usual).
    bool sample(Excitation state, double start_s, std::span<Sample> samples);

    /// Ideal demodulator parameters of these channels: exact gains and phases, the quantisation of the converter as the lower
    /// limit of every sigma (also without noise), and the linear range of the amplifiers.
    [[nodiscard]] signal::DemodulatorParams<double> demodulation() const;

    /// Standard deviation of one sample due to noise and quantisation of the converter, V.
    [[nodiscard]] double sample_sigma_v() const;
    /// Standard deviation of one coupling entry due to noise and quantisation of the converter, equal in phase and in quadrature.
    [[nodiscard]] double coupling_sigma() const;
    /// Change of a coupling that changes a sample by one code at most.
    [[nodiscard]] double coupling_step() const { return volts_per_code() / volts_per_coupling(); }
    /// Standard deviation of one sample before its quantisation, codes.
    [[nodiscard]] double noise_codes() const { return converters_.front().noise_v() / volts_per_code(); }

    /// X at a pose, without faults.
    [[nodiscard]] Mat3<double> coupling(const Pose& pose) const;
    /// X at a pose with faults, except metal and faults of the currents.
    [[nodiscard]] Mat3<double> coupling(const Pose& pose, const FaultEffect& effect) const;

    /// Couplings of the sensor's coils to fields along the axes of the source frame, S. With a field F of MetalSet (1/m^3) and
    /// the moments M of source_side(), metal adds S F M to X. Zero if the sensor is unplugged.
    [[nodiscard]] Mat3<double> sensor_side(const Pose& pose, const FaultEffect& effect) const;
    /// Moments of the source coils, one column per coil.
    [[nodiscard]] Mat3<double> source_side(const FaultEffect& effect) const { return params_.source_matrix * effect.source; }
    /// Couplings that metal adds at a pose and time, per current; objects: those that exist at `selection_s`. Call configure()
    /// before.
    [[nodiscard]] CurrentColumns metal_coupling(const Pose& pose, const FaultEffect& effect, double time_s, double selection_s);
    [[nodiscard]] FaultEffect effect_at(double time_s) const { return sim::effect_at(faults_, time_s); }
    /// Amplitude of nominal current n at the reference channel, V. Currents: see CurrentColumns.
    [[nodiscard]] double drive_amplitude(int n) const;
    /// The metal of `faults`.
    static MetalSet metal_of(const std::vector<Fault>& faults);

    [[nodiscard]] const WorldParams& params() const { return params_; }
    [[nodiscard]] const Motion& motion() const { return motion_; }
    [[nodiscard]] const signal::AcquisitionPlan& plan() const { return plan_; }
    [[nodiscard]] double volts_per_code() const { return converters_.front().volts_per_code(); }
    [[nodiscard]] std::int32_t full_scale() const { return converters_.front().full_scale(); }

private:
    [[nodiscard]] signal::ChannelResponse<double> channel_response() const;
    [[nodiscard]] double volts_per_coupling() const;
    void tune_metal();
    struct Couplings;
    [[nodiscard]] std::size_t currents() const { return plan_.has_low_band() ? kMaxCarriers : kSourceCoils; }
    [[nodiscard]] MetalSource metal_source(const FaultEffect& effect) const {
        return {source_side(effect), metal_frequencies_, currents()};
    }
    [[nodiscard]] std::optional<MetalTrack> metal_track(const FaultEffect& effect, double start_s, std::size_t samples);
    [[nodiscard]] Vec3<double> sensor_voltages(const Couplings& now, std::span<const CoilCurrent> currents) const;
    Sample convert(const Vec3<double>& sensor_v, double reference_v, double time_s, const FaultEffect& effect);

    WorldParams params_;
    const Motion& motion_;
    std::vector<Fault> faults_;
    MetalSet metal_;
    std::array<std::size_t, kMaxCarriers> metal_frequencies_{};  // see MetalSource
    signal::AcquisitionPlan plan_;
    std::array<CoilCircuit, kMaxCarriers> circuits_;  // one per current: a coil's currents add
    double drive_start_s_ = 0;                        // when the carriers started
    double end_s_ = 0;                                // of the newest block
    std::vector<Converter> converters_;               // one per channel
    std::vector<double> mains_;                       // one period if it is a whole number of samples; otherwise empty
    std::array<std::complex<double>, kSensorCoils> channel_;
    std::optional<signal::GainStep<double>> amplifier_;
    signal::ChannelResponse<double> amplification_ = signal::unit_response<double>();  // at the carriers
    std::mt19937_64 random_;
    std::mt19937_64 drop_random_;
};

}  // namespace tricoil::sim
