#include "sim/virtual_board/coils/board_circuit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/virtual_board/coils/circuit_results.hpp"
#include "sim/virtual_board/coils/low_pass.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr double kCarrierHz = 10769;        // of the results with this frequency in their name
constexpr double kCarrierDac_v = 1.44;      // amplitude at the DAC of the results drive.*
constexpr double kInputLowPass_s = 5.3e-6;  // of the power stage: (Ra || Rb) Cb in power_stage.cir
constexpr double kSense_ohm = 0.33;         // rs
constexpr double kUnsettled = 1e-4;         // of the result slot.settling_us
constexpr double kCornerHz = 40e3;          // of preamplifiers and reference amplifier
constexpr double kDamping_ohm = 10e3;       // rdamp

// Deviations of parts, uniform within these limits.
constexpr double kWinding = 10e-3;  // turns times area of a coil
constexpr double kInductance = 20e-3;
constexpr double kSenseMake = 1e-3;
constexpr double kPreamplifierMake = 2e-3;  // two ratios of 0.1 % resistors
constexpr double kCornerMake = 10e-3;       // NP0 capacitors
constexpr double kAngle_rad = 10e-3;        // between sensor coils
constexpr double kStageMake = 5e-3;
constexpr double kFillingMake = 0.2;        // resistor of the ladder, capacitor
constexpr double kPickUp_v_per_a = 2.8e-6;  // 0.5 % of the largest coupling at 0.75 m, the limit at bring-up

// Temperature coefficients, 1/K.
constexpr double kSenseDrift = 15e-6;
constexpr double kPreamplifierDrift = 10e-6;  // of each of two resistor ratios
constexpr double kExpansion = 14e-6;          // of the formers' diameter; the same for all
constexpr double kCopperDrift = 3.9e-3;

/// Random deviations of one board.
class Parts {
public:
    Parts(std::uint64_t seed, double warmer_k) : random_(seed ^ kStream), has_deviations_(seed != 0), warmer_k_(warmer_k) {}

    std::mt19937_64& random() { return random_; }
    double within(double limit) { return has_deviations_ ? limit * unit_(random_) : (unit_(random_), 0.0); }
    double make(double limit) { return 1 + within(limit); }
    /// With a coefficient of its own within `limit`, 1/K. Drifts on every board.
    double drift(double limit) { return 1 + limit * unit_(random_) * warmer_k_; }

private:
    static constexpr std::uint64_t kStream = 0x5EED'0F'B0A4D5;

    std::mt19937_64 random_;
    std::uniform_real_distribution<double> unit_{-1, 1};
    bool has_deviations_;
    double warmer_k_;
};

double response_of_pole(double lag_s) { return 1 / std::hypot(1, 2 * std::numbers::pi * kCarrierHz * lag_s); }
double response_of_low_pass() { return LowPass::response(kCarrierHz, kCornerHz); }

/// The coil settles exponentially through the resistance of coil and stage, which follows from the settling time of S1.
void draw_source(Parts& parts, double expansion, BoardCircuit& board) {
    constexpr std::array kInductance_h{circuit_result("coils.s1_h"), circuit_result("coils.s2_h"), circuit_result("coils.s3_h")};
    constexpr std::array kCoil_ohm{circuit_result("coils.s1_ohm"), circuit_result("coils.s2_ohm"),
                                   circuit_result("coils.s3_ohm")};
    constexpr std::array kArea_m2{circuit_result("coils.s1_m2"), circuit_result("coils.s2_m2"), circuit_result("coils.s3_m2")};
    const double settling_s = 1e-6 * circuit_result("slot.settling_us") / -std::log(kUnsettled);
    const double stage_ohm = kInductance_h[0] / settling_s - kCoil_ohm[0];
    const double at_carrier = circuit_result("drive.full_a") / kCarrierDac_v;
    const double direct = at_carrier / response_of_pole(settling_s) / response_of_pole(kInputLowPass_s);
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        DrivenCoil::Params& stage = board.stages[j];
        stage.smoothing_s = kInputLowPass_s;
        stage.amperes_per_volt = direct * parts.make(kStageMake);
        stage.resistance_ohm = stage_ohm + kCoil_ohm[j];
        stage.inductance_h = kInductance_h[j] * parts.make(kInductance);
        stage.supply_v = circuit_result("drive.swing_v");
        stage.limit_a = circuit_result("drive.limit_a");
        board.source_m2[j] = kArea_m2[j] * parts.make(kWinding) * expansion;
        board.sense_ohm[j] = kSense_ohm * parts.make(kSenseMake) * parts.drift(kSenseDrift);
    }
}

void draw_sensor(Parts& parts, double expansion, double warmer_k, BoardCircuit& board) {
    constexpr std::array kNoise{circuit_result("preamplifier.noise_inner_10769"), circuit_result("preamplifier.noise_10769"),
                                circuit_result("preamplifier.noise_10769")};  // of the outer coil: at most that of the middle one
    constexpr double kGain = circuit_result("preamplifier.gain_10769");
    const double copper = 1 - kCopperDrift * warmer_k * circuit_result("coils.sensor_ohm") / kDamping_ohm;
    for (std::size_t i = 0; i < kSensorCoils; ++i) {
        board.sensor_m2[i] = circuit_result("coils.sensor_m2") * parts.make(kWinding) * expansion;
        for (int k = 0; k < 3; ++k) {
            board.sensor_axes(static_cast<Index>(i), k) += parts.within(kAngle_rad);
        }
        const double ratios = parts.drift(kPreamplifierDrift) * parts.drift(kPreamplifierDrift);
        board.channels[i].gain = kGain / response_of_low_pass() * parts.make(kPreamplifierMake) * ratios * copper;
        board.channels[i].corner_hz = kCornerHz * parts.make(kCornerMake);
        board.channels[i].noise_v_per_sqrt_hz = kNoise[i] * kGain;
    }
}

}  // namespace

BoardCircuit BoardCircuit::draw(std::uint64_t seed, double warmer_k) {
    BoardCircuit board;
    Parts parts(seed, warmer_k);
    const double expansion = std::pow(1 + kExpansion * warmer_k, 2);
    draw_source(parts, expansion, board);
    draw_sensor(parts, expansion, warmer_k, board);
    AnalogChannel& reference = board.channels[kReferenceChannel];
    reference.gain = circuit_result("reference.gain") / response_of_low_pass();
    reference.corner_hz = kCornerHz * parts.make(kCornerMake);
    reference.noise_v_per_sqrt_hz = circuit_result("reference.noise");
    std::ranges::generate(board.amplifiers, [&] { return SensorAmplifier(parts.random()); });
    std::ranges::generate(board.converters, [&] { return seed != 0 ? ConverterError(parts.random()) : ConverterError(); });
    for (SensorAmplifier& amplifier : board.amplifiers) {
        amplifier.filling_s *= parts.make(kFillingMake);
    }
    for (Index k = 0; k < 9; ++k) {
        board.pick_up(k / 3, k % 3) = parts.within(kPickUp_v_per_a);
    }
    return board;
}

}  // namespace tricoil::virtual_board
