// Analog side of the board: triggers, converters, DAC outputs, op-amps, coils.
#include <algorithm>
#include <cmath>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {
namespace {

/// Op-amp and ADC channel of one sensor coil; the pins are in the board's wiring table. `dac`, `dac_channel`: the on-chip DAC
/// that the op-amp can select as its input instead (RM0440, "OPAMP non-inverting inputs").
struct SensorInput {
    char port;
    unsigned pin;
    unsigned amplifier;
    unsigned channel;
    unsigned dac;
    unsigned dac_channel;  // 0, 1
};
constexpr std::array<SensorInput, kSensorCoils> kSensors{{{'B', 0, 3, 13, 3, 1}, {'B', 12, 6, 17, 3, 0}, {'B', 13, 4, 5, 4, 0}}};
constexpr unsigned kReferencePin = 0;                               // PA0
constexpr unsigned kReferenceInput = 1;                             // ADC1_IN1
constexpr unsigned kThermistorPin = 0;                              // PC0
constexpr unsigned kThermistorInput = 6;                            // ADC1_IN6
constexpr std::array<unsigned, kSourceCoils> kDrivePins{4, 5, 6};   // port A
constexpr std::array<unsigned, kChannels> kConverters{3, 4, 5, 1};  // of the channels

constexpr double kCodes = 4096;
constexpr double kConverterNoiseCodes = 0.67;  // together with quantisation: 66 dB (DS12288)

// Internal inputs of the converters (DS12288, typical values).
constexpr unsigned kReferenceVoltageInput = 18;
constexpr double kReferenceVoltageV = 1.212;
constexpr double kThermometerV = 0.76;  // at 30 degrees Celsius
constexpr double kThermometerVPerDegree = 2.5e-3;
constexpr double kBatteryV = CoilBench::kSupplyV / 3;

/// Trigger numbers of a timer's TRGO at the DACs and converters; 0xFF: not connected (RM0440, tables of triggers).
struct TimerTriggers {
    unsigned timer;
    unsigned dac_3;
    unsigned other_dacs;
    unsigned adc;
    unsigned adc_injected;
};
constexpr unsigned kNone = 0xFF;
constexpr std::array<TimerTriggers, 9> kTriggers{{{1, 1, kNone, 9, 0},
                                                  {2, 4, 4, 11, 2},
                                                  {3, 8, 8, 4, 12},
                                                  {4, 5, 5, 12, 5},
                                                  {6, 7, 7, 13, 14},
                                                  {7, 2, 2, 30, 30},
                                                  {8, kNone, 1, 7, 9},
                                                  {15, 3, 3, 14, 15},
                                                  {20, kNone, kNone, 16, 16}}};

}  // namespace

void VirtualBoard::wire_analog() {
    for (unsigned n = 0; n < kTriggers.size(); ++n) {
        general.timer(kTriggers[n].timer).on_trigger.emplace_back([this, n] { trigger(n); });
    }
    for (unsigned n = 0; n < kChannels; ++n) {
        adcs_[n]->sample = [this, n](Ticks held) {
            bench.advance(seconds(held));
            return code_of(n);
        };
        adcs_[n]->on_result = [this, n](std::uint32_t result) { record(n, result); };
    }
    adc_2_.sample = [this](Ticks) { return free_converter_code(); };
}

/// The converter of the reference channel finishes last.
void VirtualBoard::record(std::size_t channel, std::uint32_t result) {
    sample_.codes[channel] = static_cast<std::uint16_t>(result);
    if (channel != kReferenceChannel || adcs_[channel]->channel() != kReferenceInput || !on_sample) {
        return;
    }
    sample_.time = machine.now();
    sample_.gain = static_cast<std::uint8_t>(opamp_.gain(kSensors[0].amplifier));
    sample_.driven = 0;
    for (unsigned j = 0; j < kSourceCoils; ++j) {
        sample_.driven = static_cast<std::uint8_t>(sample_.driven | flag(is_enabled(j), j));
    }
    on_sample(sample_);
}

void VirtualBoard::drive() {
    const std::array<std::pair<const Dac*, unsigned>, kSourceCoils> outputs{{{&dac_1_, 0}, {&dac_1_, 1}, {&dac_2_, 0}}};
    for (unsigned j = 0; j < kSourceCoils; ++j) {
        const auto& [dac, channel] = outputs[j];
        const bool is_connected = dac->is_on(channel) && !dac->is_inside(channel) && gpio('A').is_analog(kDrivePins[j]);
        const double swing = is_connected ? dac->code(channel) / kCodes * CoilBench::kSupplyV - CoilBench::kHalfSupplyV : 0;
        bench.drive(static_cast<int>(j), swing, is_enabled(j));
    }
}

/// Share of the supply at the pin of the heat sink's thermistor: NTC of 10 kOhm and B = 3977 K below 10 kOhm.
double VirtualBoard::thermistor_share() const {
    const double ratio = std::exp(3977 * (1 / (heat_sink_celsius + 273.15) - 1 / 298.15));
    return ratio / (1 + ratio);
}

/// Output voltage of the on-chip DAC that a sensor channel's op-amp can select as its input.
double VirtualBoard::internal_dac_v(unsigned channel) const {
    const SensorInput& input = kSensors[channel];
    const Dac& dac = input.dac == 3 ? dac_3_ : dac_4_;
    if (!dac.is_on(input.dac_channel) || !dac.is_inside(input.dac_channel)) {
        return -CoilBench::kHalfSupplyV;
    }
    return dac.code(input.dac_channel) / kCodes * CoilBench::kSupplyV - CoilBench::kHalfSupplyV;
}

/// Output of a channel's amplifier with noise and low-pass. The output stage is supplied by AVDD. Steps of the DAC, which the
/// low-pass removes, are small in flux and current, but not in the derivative of the flux, where sampling would alias them onto
/// the carrier.
double VirtualBoard::filtered(unsigned channel, double step_s) {
    constexpr double kRailV = CoilBench::kHalfSupplyV - 0.05;
    const double noise_v = circuit.channels[channel].noise_v_per_sqrt_hz * std::sqrt(0.5 / step_s) * normal_(random_);
    const int coil = static_cast<int>(channel);
    double volts = 0;
    if (channel == kReferenceChannel) {
        volts = low_pass_[channel].follow(bench.reference_v() + noise_v, step_s);
    } else {
        (void)flux_low_pass_[channel].follow(bench.flux_vs(coil), step_s);
        volts = low_pass_[channel].follow(bench.sensor_v(coil) + noise_v, step_s) + flux_low_pass_[channel].slope();
    }
    return std::clamp(volts, -kRailV, kRailV);
}

/// Voltage above ground of an internal input; empty: the channel is not one of them.
std::optional<double> VirtualBoard::internal_input_v(unsigned converter, unsigned channel) const {
    const AdcCommon& common = converter <= 2 ? common_12_ : common_345_;
    const bool is_thermometer = (converter == 1 && channel == 16) || (converter == 5 && channel == 4);
    const bool is_battery = channel == 17 && (converter == 1 || converter == 5);
    const double scale = CoilBench::kSupplyV / shown_supply_v;
    if (channel == kReferenceVoltageInput && converter != 2) {
        return common.reference_is_on() ? scale * kReferenceVoltageV : 0;
    }
    if (is_thermometer) {
        const double volts = kThermometerV + kThermometerVPerDegree * (chip_celsius - 30);
        return common.thermometer_is_on() ? scale * volts : 0;
    }
    return is_battery ? std::optional(common.battery_is_on() ? kBatteryV : 0) : std::nullopt;
}

/// Voltage of a sensor coil behind its op-amp, relative to half the supply. Adds to `noise`, in codes.
double VirtualBoard::sensor_input_v(unsigned channel, double step_s, double& noise) {
    const SensorInput& input = kSensors[channel];
    const Adc& adc = *adcs_[channel];
    const double gain = opamp_.gain(input.amplifier);
    if (gain <= 0 || adc.channel() != input.channel || !gpio(input.port).is_analog(input.pin)) {
        return -CoilBench::kHalfSupplyV;
    }
    SensorAmplifier& amplifier = circuit.amplifiers[channel];
    if (opamp_.input(input.amplifier) == Opamp::Input::dac) {
        amplifier.jump(internal_dac_v(channel), gain, step_s, seconds(adc.sampling_time()));
    } else {
        amplifier.follow(filtered(channel, step_s), gain, step_s);
    }
    noise = std::hypot(noise, amplifier.noise_v(gain) * kCodes / CoilBench::kSupplyV);
    return amplifier.output_v();
}

std::uint32_t VirtualBoard::code_of(unsigned channel) {
    const Adc& adc = *adcs_[channel];
    double volts = -CoilBench::kHalfSupplyV;  // an unconnected input, or an op-amp that is off
    double noise = kConverterNoiseCodes;
    const double step_s = std::max(seconds(machine.now() - last_conversion_[channel]), 1e-9);
    const auto inside = internal_input_v(kConverters[channel], adc.channel());
    if (inside) {
        volts = *inside - CoilBench::kHalfSupplyV;
    } else if (channel != kReferenceChannel) {
        volts = sensor_input_v(channel, step_s, noise);
    } else if (adc.channel() == kReferenceInput && gpio('A').is_analog(kReferencePin)) {
        volts = filtered(channel, step_s);
    } else if (adc.channel() == kThermistorInput && gpio('C').is_analog(kThermistorPin)) {
        volts = thermistor_share() * CoilBench::kSupplyV - CoilBench::kHalfSupplyV;
    }
    last_conversion_[channel] = machine.now();
    const double ideal = (volts + CoilBench::kHalfSupplyV) * kCodes / CoilBench::kSupplyV;
    const double code =
        circuit.converters[channel].code(ideal + noise * (inside ? inside_normal_(inside_random_) : normal_(random_)));
    const bool stuck = bench.is_stuck(static_cast<int>(channel));
    return stuck ? 2048U : static_cast<std::uint32_t>(std::clamp(std::nearbyint(code), 0.0, kCodes - 1));
}

/// ADC2: its pins are open.
std::uint32_t VirtualBoard::free_converter_code() {
    const double code = kConverterNoiseCodes * normal_(random_);
    return static_cast<std::uint32_t>(std::clamp(std::nearbyint(code), 0.0, kCodes - 1));
}

/// `n`: row of kTriggers.
void VirtualBoard::trigger(unsigned n) {
    const TimerTriggers& by = kTriggers[n];
    bench.advance(now_s());
    dac_1_.trigger(by.other_dacs);
    dac_2_.trigger(by.other_dacs);
    dac_3_.trigger(by.dac_3);
    dac_4_.trigger(by.other_dacs);
    drive();
    for (const auto& adc : adcs_) {
        adc->trigger(by.adc, by.adc_injected);
    }
    adc_2_.trigger(by.adc, by.adc_injected);
}

}  // namespace tricoil::virtual_board
