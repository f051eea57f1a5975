#include "tests/stm32g4/hardware_tables.hpp"

#include <cstdarg>
#include <cstdio>
#include <iterator>

#include "board/nucleo_g474re/analog_budget.hpp"
#include "board/nucleo_g474re/pins.hpp"

namespace tricoil::test {
namespace {

using namespace nucleo_g474re;

constexpr const char* kModeNames[] = {"TDM 240", "FDM 240", "FDM 960", "TDM 480"};  // in the order of kModes
static_assert(std::size(kModeNames) == kModes.size());

class Lines {
public:
    __attribute__((format(printf, 2, 3))) void add(const char* format, ...) {
        char line[256];
        std::va_list arguments;
        va_start(arguments, format);
        std::vsnprintf(line, sizeof line, format, arguments);
        va_end(arguments);
        text_ += line;
        text_ += '\n';
    }
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    std::string text_;
};

std::string pins() {
    struct Row {
        PinName pin;
        const char* what;
        const char* where;
    };
    const Row rows[] = {
        {kCarrier1, "carrier of coil S1, to its power stage", "DAC1_OUT1"},
        {kCarrier2, "carrier of coil S2; also LD2, see below", "DAC1_OUT2"},
        {kCarrier3, "carrier of coil S3", "DAC2_OUT1"},
        {kEnable1, "enable of S1's power stage, high is on", "GPIO"},
        {kEnable2, "enable of S2's", "GPIO"},
        {kEnable3, "enable of S3's", "GPIO"},
        {kHeartbeat, "heartbeat of the hardware enable", "GPIO"},
        {kReference, "reference: current of all coils, 0.7 V/A about the middle", "ADC1_IN1"},
        {kSensor1, "sensor coil 1, from its preamplifier", "OPAMP3_VINP0"},
        {kSensor1Capacitor, "1 uF to ground", "OPAMP3_VINM0"},
        {kSensor2, "sensor coil 2", "OPAMP6_VINP0"},
        {kSensor2Capacitor, "1 uF to ground", "OPAMP6_VINM0"},
        {kSensor3, "sensor coil 3", "OPAMP4_VINP0"},
        {kSensor3Capacitor, "1 uF to ground", "OPAMP4_VINM0"},
        {kStatusLed, "status LED through 1 kOhm to ground", "GPIO"},
        {kSerialTx, "serial line, to the ST-LINK", "USART2_TX"},
        {kSerialRx, "serial line, from the ST-LINK", "USART2_RX"},
        {kCanRx, "CAN transceiver's RXD", "FDCAN2_RX"},
        {kCanTx, "CAN transceiver's TXD", "FDCAN2_TX"},
        {kUsbMinus, "D- of the USB connector", "USB_DM"},
        {kUsbPlus, "D+", "USB_DP"},
    };
    Lines out;
    out.add("| pin | what is wired there | peripheral |");
    out.add("|---|---|---|");
    for (const Row& row : rows) {
        out.add("| P%c%u | %s | %s |", row.pin.port, unsigned{row.pin.number}, row.what, row.where);
    }
    return out.text();
}

std::string coils() {
    const AnalogBudget budget;
    const AnalogDesign& d = budget.design();
    Lines out;
    out.add("| | source coil | sensor coil |");
    out.add("|---|---|---|");
    const auto row = [&](const char* what, const char* format, double source, double sensor) {
        char values[64];
        std::snprintf(values, sizeof values, format, source, sensor);
        out.add("| %s | %s |", what, values);
    };
    row("turns", "%.0f | %.0f", d.source.turns, d.sensor.turns);
    row("mean radius, mm", "%.0f | %.0f", 1e3 * d.source.radius_m, 1e3 * d.sensor.radius_m);
    row("winding: length along the axis, depth, mm", "10, 2 | 4, 1.5", 0, 0);
    row("copper wire, mm", "%.1f | %.1f", 1e3 * d.source.wire_m, 1e3 * d.sensor.wire_m);
    row("wire length, m", "%.1f | %.1f", d.source.wire_length_m(), d.sensor.wire_length_m());
    row("resistance, ohm", "%.2f | %.1f", d.source.resistance_ohm(), d.sensor.resistance_ohm());
    row("inductance, mH", "%.3f | %.2f", 1e3 * d.source.inductance_h(), 1e3 * d.sensor.inductance_h());
    row("turns times area, cm^2", "%.0f | %.0f", 1e4 * d.source.area_m2(), 1e4 * d.sensor.area_m2());
    return out.text();
}

std::string drive() {
    const AnalogBudget budget;
    Lines out;
    out.add("| mode | coil | carrier, kHz | current, A | drop with the capacitor, V | without it, V |");
    out.add("|---|---|---|---|---|---|");
    for (std::size_t m = 0; m < 2; ++m) {
        const auto& hz = kModes[m].plan.params.carrier_hz;
        const bool in_turn = kModes[m].plan.params.multiplexing == signal::Multiplexing::tdm;
        for (std::size_t j = 0; j < (in_turn ? 1 : hz.size()); ++j) {
            const double current = budget.design().current_a * (in_turn ? 1 : 0.65 * hz[0] / hz[j]);
            out.add("| %s | %s | %.2f | %.2f | %.1f | %.1f |", kModeNames[m],
                    in_turn  ? "each"
                    : j == 0 ? "S1"
                    : j == 1 ? "S2"
                             : "S3",
                    hz[j] / 1e3, current, budget.drive_v(current, hz[j]), budget.bare_drive_v(current, hz[j]));
        }
    }
    return out.text();
}

std::string levels() {
    const AnalogBudget budget;
    const ModeLoad load = ModeLoad::of(kModes[0].plan);
    Lines out;
    out.add("| range, m | field, nT | sensor coil, uV | op-amp's input, mV | gain | converter, V |");
    out.add("|---|---|---|---|---|---|");
    for (const double range : {0.15, 0.3, 0.6, 1.2}) {
        const int step = budget.gain_step(range, load);
        const double gain = AnalogBudget::gain(step);
        out.add("| %.2f | %.1f | %.1f | %.2f | %.0f | %.3f |", range, 1e9 * budget.field_t(range),
                1e6 * budget.induced_v(range, load.hz), 1e3 * budget.signal_v(range, load), gain,
                budget.signal_v(range, load) * gain);
    }
    return out.text();
}

std::string noise() {
    const AnalogBudget budget;
    Lines out;
    out.add("| gain | 12-bit converter, nV/rtHz | op-amp | preamplifier | together |");
    out.add("|---|---|---|---|---|");
    for (int step = 0; step < stm32g4::SensorAmplifiers::kSteps; ++step) {
        out.add("| %.0f | %.0f | %.0f | %.0f | %.0f |", AnalogBudget::gain(step), 1e9 * budget.adc_density(),
                1e9 * budget.opamp_density(step), 1e9 * budget.preamplifier_density(step), 1e9 * budget.density(step));
    }
    return out.text();
}

std::string signal_to_noise() {
    const AnalogBudget budget;
    Lines out;
    out.add("| mode | window, ms | SNR at 0.3 m, dB | 0.6 m | 1.2 m | with 24 bits: 0.3 m | 0.6 m | 1.2 m |");
    out.add("|---|---|---|---|---|---|---|---|");
    for (std::size_t m = 0; m < kModes.size(); ++m) {
        const ModeLoad load = ModeLoad::of(kModes[m].plan);
        out.add("| %s | %.2f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f |", kModeNames[m], 1e3 * load.window_s,
                budget.snr_db(0.3, load), budget.snr_db(0.6, load), budget.snr_db(1.2, load), budget.external_snr_db(0.3, load),
                budget.external_snr_db(0.6, load), budget.external_snr_db(1.2, load));
    }
    return out.text();
}

std::string errors() {
    const AnalogBudget budget;
    const ModeLoad load = ModeLoad::of(kModes[0].plan);
    Lines out;
    out.add("| range, m | SNR, dB | range error, mm | across, mm |");
    out.add("|---|---|---|---|");
    for (const double range : {0.3, 0.6, 1.2}) {
        const double db = budget.snr_db(range, load);
        out.add("| %.1f | %.1f | %.3f | %.3f |", range, db, 1e3 * AnalogBudget::range_error_m(range, db),
                1e3 * AnalogBudget::cross_error_m(range, db));
    }
    return out.text();
}

std::string oversampling() {
    Lines out;
    out.add(
        "| conversions a sample | samples a second | a TDM slot at 240 Hz, samples | memory of the two halves, bytes | "
        "attenuation at 13.4 kHz, dB |");
    out.add("|---|---|---|---|---|");
    for (const int n : {2, 4, 8, 16}) {
        const double rate = stm32g4::Acquisition::sample_rate_hz(n);
        const double slot = rate / (3 * kModes[0].plan.params.frame_rate_hz);
        const double x = std::numbers::pi * kModes[1].plan.params.carrier_hz[2] / rate;
        out.add("| %d | %.0f | %.0f | %.0f | %.2f |", n, rate, slot, 2 * 2 * 4 * 3 * slot, -20 * std::log10(std::sin(x) / x));
    }
    return out.text();
}

std::string values() {
    const AnalogBudget budget;
    Lines out;
    out.add("- magnetic moment %.3f A m^2; reference amplifier x%.1f; preamplifiers x%.1f", budget.moment_a_m2(),
            budget.reference_gain(), budget.preamplifier_gain());
    out.add("- coil and series capacitor resonate at %.2f kHz; full drive is %.2f V at the DAC for %.1f A",
            budget.resonance_hz() / 1e3, 1792.0 * kSupply_v / 4096, budget.design().current_a);
    out.add("- over-current: %.2f A ends the measurement, %.2f A drops the enables by hardware",
            double{kMostReference_v} / AnalogBudget::kFullReference_v * budget.design().current_a,
            double{kMostReference_v * kTripMargin} / AnalogBudget::kFullReference_v * budget.design().current_a);
    return out.text();
}

}  // namespace

std::vector<HardwareTable> hardware_tables() {
    return {{"pins", pins()},
            {"coils", coils()},
            {"values", values()},
            {"drive", drive()},
            {"levels", levels()},
            {"noise", noise()},
            {"signal to noise", signal_to_noise()},
            {"errors", errors()},
            {"oversampling", oversampling()}};
}

}  // namespace tricoil::test
