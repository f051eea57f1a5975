#include "tests/stm32g4/hardware_tables.hpp"

#include <cstdarg>
#include <cstdio>
#include <iterator>

#include "board/nucleo_g474re/measuring.hpp"
#include "board/nucleo_g474re/pins.hpp"

namespace tricoil::test {
namespace {

using namespace nucleo_g474re;

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
        {kEnable2, "enable of S2's power stage", "GPIO"},
        {kEnable3, "enable of S3's power stage", "GPIO"},
        {kHeartbeat, "heartbeat of the hardware enable", "GPIO"},
        {kReference, "reference: current of all coils, 0.7 V at full drive", "ADC1_IN1"},
        {kThermistor, "heat sink: NTC to analog ground, 10 kOhm to AVDD", "ADC1_IN6"},
        {kStagesCool, "low: a power stage is in thermal shutdown", "GPIO"},
        {kSensor1, "sensor coil 1, from its preamplifier", "OPAMP3_VINP0"},
        {kSensor1Capacitor, "1 uF to ground", "OPAMP3_VINM0"},
        {kSensor2, "sensor coil 2", "OPAMP6_VINP0"},
        {kSensor2Capacitor, "1 uF to ground", "OPAMP6_VINM0"},
        {kSensor3, "sensor coil 3", "OPAMP4_VINP0"},
        {kSensor3Capacitor, "1 uF to ground", "OPAMP4_VINM0"},
        {kStatusLed, "status LED through 1 kOhm to ground", "GPIO"},
        {kButton, "button B1 of the Nucleo, high while pressed", "GPIO"},
        {kSerialTx, "serial line, to the ST-LINK", "USART2_TX"},
        {kSerialRx, "serial line, from the ST-LINK", "USART2_RX"},
        {kCanRx, "CAN transceiver's RXD", "FDCAN2_RX"},
        {kCanTx, "CAN transceiver's TXD", "FDCAN2_TX"},
        {kUsbMinus, "D- of the USB connector", "USB_DM"},
        {kUsbPlus, "D+", "USB_DP"},
    };
    Lines out;
    out.add("| pin | connection | peripheral |");
    out.add("|---|---|---|");
    for (const Row& row : rows) {
        out.add("| P%c%u | %s | %s |", row.pin.port, unsigned{row.pin.number}, row.what, row.where);
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

std::string over_current() {
    Lines out;
    out.add("- over-current: %.2f V at PA0 ends the measurement, %.2f V drops the enables by hardware", double{kMaxReference_v},
            double{kMaxReference_v * kTripMargin});
    return out.text();
}

}  // namespace

std::vector<HardwareTable> hardware_tables() {
    return {{"pins", pins()}, {"over-current", over_current()}, {"oversampling", oversampling()}};
}

}  // namespace tricoil::test
