// Noise of the board's first design, which the virtual board simulates. The present design is in board/nucleo_g474re/circuits.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "board/app/gain_ranging.hpp"
#include "board/nucleo_g474re/measuring.hpp"

namespace tricoil::nucleo_g474re {

constexpr double kVacuum = 4e-7 * std::numbers::pi;  // permeability, V s / (A m)
constexpr double kSupply_v = 3.3;

/// A round winding.
struct Winding {
    int turns;
    double radius_m;  // mean radius

    [[nodiscard]] double area_m2() const { return turns * std::numbers::pi * radius_m * radius_m; }
};

/// Load of the most critical coil in a mode.
struct ModeLoad {
    double hz = 0;
    double drive = 1;  // share of the full current
    double crest = 1;  // largest ratio of the sum of all carriers to one carrier, at a sensor coil
    double window_s = 0;

    /// FDM: all signals have the same size and the largest current is 0.65 of the full one. The sum of a row's couplings is at
    /// most sqrt(3) k.
    static ModeLoad of(const signal::AcquisitionPlan& plan) {
        const auto& hz = plan.params.carrier_hz;
        return plan.params.multiplexing == signal::Multiplexing::tdm
                   ? ModeLoad{hz[0], 1, 1, plan.window_s()}
                   : ModeLoad{hz[2], 0.65 * hz[0] / hz[2], std::numbers::sqrt3, plan.window_s()};
    }
};

struct AnalogDesign {
    Winding source{60, 0.030};
    double current_a = 1.0;  // amplitude at full drive
    Winding sensor{400, 0.005};
    double preamplifier_v_rthz = 3.2e-9;  // AD8421, referred to its input
    double opamp_v_rthz = 100e-9;         // of the processor's op-amps at 10 kHz; estimated, its share is small
    double adc_snr_db = 66;               // of a 12-bit conversion of a full-scale sine; estimated, about as in DS12288
};

class AnalogBudget {
public:
    explicit AnalogBudget(const AnalogDesign& design = {}) : d_(design) {}

    // --- Source
    [[nodiscard]] double moment_a_m2() const { return d_.source.area_m2() * d_.current_a; }

    // --- Sensor
    /// Field amplitude on the axis of the source coil: mu0 m / (2 pi r^3).
    [[nodiscard]] double field_t(double range_m) const {
        return kVacuum * moment_a_m2() / (2 * std::numbers::pi * std::pow(range_m, 3));
    }
    [[nodiscard]] double induced_v(double range_m, double hz) const { return w(hz) * field_t(range_m) * d_.sensor.area_m2(); }
    /// Gain at which the coupling constant is that of measuring.hpp.
    [[nodiscard]] double preamplifier_gain() const {
        const double wanted_v = kFullReference_v * double{kCouplingConstant} / std::pow(kRange_m, 3);
        return wanted_v / induced_v(kRange_m, kUnityResponseHz);
    }
    /// Amplitude of one carrier at an op-amp's input.
    [[nodiscard]] double signal_v(double range_m, const ModeLoad& load) const {
        return preamplifier_gain() * induced_v(range_m, load.hz) * load.drive;
    }

    /// Largest step that automatic gain selects.
    [[nodiscard]] int gain_step(double range_m, const ModeLoad& load) const {
        const double most_v = double{app::GainRangingParams{}.comfortable} * kSupply_v / 2 / load.crest;
        int step = 0;
        while (step + 1 < stm32g4::SensorAmplifiers::kSteps && signal_v(range_m, load) * gain(step + 1) <= most_v) {
            ++step;
        }
        return step;
    }
    static double gain(int step) { return double{stm32g4::SensorAmplifiers::gain_of(static_cast<std::uint8_t>(step))}; }

    // --- Noise: densities at the carrier, one-sided, V/sqrt(Hz) at the converter
    /// White noise over half the conversion rate. Adding conversions does not change the density near the carrier.
    [[nodiscard]] double adc_density() const {
        const double rms_v = kSupply_v / 2 / std::numbers::sqrt2 / std::pow(10, d_.adc_snr_db / 20);
        return rms_v / std::sqrt(conversion_hz() / 2);
    }
    /// Op-amp noise has a bandwidth of pi/2 GBW/gain, which exceeds half the conversion rate, so it aliases.
    [[nodiscard]] double opamp_density(int step) const {
        const double reach_hz = std::numbers::pi / 2 * double{stm32g4_board::kGainBandwidthHz} / gain(step);
        return d_.opamp_v_rthz * gain(step) * std::sqrt(std::max(1.0, reach_hz / (conversion_hz() / 2)));
    }
    /// A low-pass of 100 kHz prevents aliasing.
    [[nodiscard]] double preamplifier_density(int step) const {
        return d_.preamplifier_v_rthz * preamplifier_gain() * gain(step);
    }
    [[nodiscard]] double density(int step) const {
        return std::hypot(adc_density(), opamp_density(step), preamplifier_density(step));
    }

    /// k / sigma of one coupling, dB. Lock-in over a window has the standard deviation density / sqrt(window). The relative noise
    /// of the reference is added.
    [[nodiscard]] double snr_db(double range_m, const ModeLoad& load) const {
        const int step = gain_step(range_m, load);
        const double sensor = density(step) / (signal_v(range_m, load) * gain(step));
        return in_db(sensor, adc_density() / (kFullReference_v * load.drive), load.window_s);
    }

    /// Errors of one frame: of the range, and of each coordinate perpendicular to it (closed-form bound; core/solver).
    static double range_error_m(double range_m, double snr_db) { return range_m / ratio(snr_db) / std::sqrt(13.5); }
    static double cross_error_m(double range_m, double snr_db) { return range_m / ratio(snr_db) * std::sqrt(1.25 / 0.5625); }

    static double conversion_hz() { return kSampleRateHz * kOversampling; }
    static constexpr double kFullReference_v = 0.7;  // amplitude at PA0 at full drive

private:
    static constexpr double kRange_m = 0.3;  // range for the gain calculation; the result does not depend on it

    static double w(double hz) { return 2 * std::numbers::pi * hz; }
    static double ratio(double db) { return std::pow(10, db / 20); }
    static double in_db(double sensor_rthz, double reference_rthz, double window_s) {
        return -20 * std::log10(std::hypot(sensor_rthz, reference_rthz) / std::sqrt(window_s));
    }

    AnalogDesign d_;
};

}  // namespace tricoil::nucleo_g474re
