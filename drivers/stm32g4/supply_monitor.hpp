// Supply voltage and temperatures of chip and heat sink, measured by the converter of the reference; flag of the power stages.
#pragma once

#include <cmath>

#include "drivers/stm32g4/converters.hpp"
#include "drivers/stm32g4/gpio.hpp"
#include "hal/board_monitor.hpp"

namespace tricoil::stm32g4 {

class SupplyMonitor final : public hal::BoardMonitor {
public:
    /// Codes that the factory measured at a supply of 3.0 V (DS12288, "Internal voltage reference", "Temperature sensor").
    struct Factory {
        std::uint16_t reference;
        std::uint16_t at_30_degrees;
        std::uint16_t at_130_degrees;
    };

    /// `thermistor`: its converter input. `cool`: a line that is high while no stage is in thermal shutdown.
    SupplyMonitor(Converters& converters, const Factory& factory, std::uint8_t thermistor, const Pin& cool)
        : converters_(converters), factory_(factory), thermistor_(thermistor), cool_(cool) {}

    /// Arguments: codes of the voltage reference, the chip's thermometer and the thermistor.
    [[nodiscard]] static hal::BoardReading reading_of(int reference, int thermometer, int thermistor, const Factory& factory) {
        const int span = factory.at_130_degrees - factory.at_30_degrees;
        if (reference <= 0 || span <= 0) {
            return {0, 0, heat_sink_of(thermistor)};
        }
        const int supply_mv = kFactory_mv * factory.reference / reference;
        if (supply_mv > kLargest_mv) {  // above the absolute maximum rating of the chip: the reading is wrong
            return {0, 0, heat_sink_of(thermistor)};
        }
        const int at_factory_supply = thermometer * supply_mv / kFactory_mv;
        const int cdeg = 3000 + (at_factory_supply - factory.at_30_degrees) * 10'000 / span;
        return {static_cast<std::uint16_t>(supply_mv), static_cast<std::int16_t>(cdeg), heat_sink_of(thermistor)};
    }

private:
    static constexpr int kFactory_mv = 3000;
    static constexpr int kLargest_mv = 5000;

    /// NTC of 10 kOhm at 25 degrees from the pin to ground, 10 kOhm from the pin to the supply: 1 / T = 1 / T25 + ln(R / R25) /
    /// B.
    [[nodiscard]] static std::int16_t heat_sink_of(int code) {
        if (code < kLowest || code > kHighest) {
            return hal::BoardReading::kNoThermistor_cdeg;
        }
        const float ratio = static_cast<float>(code) / static_cast<float>(4096 - code);
        return static_cast<std::int16_t>(100 * (1 / (1 / 298.15F + std::log(ratio) / kB_k) - 273.15F));
    }

    [[nodiscard]] hal::BoardReading do_read() override {
        const auto reference = converters_.measure_one(Converters::kVoltageReference);
        const auto thermometer = converters_.measure_one(Converters::kThermometer);
        const auto thermistor = converters_.measure_one(thermistor_);
        const bool measured = reference.ok() && thermometer.ok() && thermistor.ok();
        return measured ? reading_of(*reference, *thermometer, *thermistor, factory_) : hal::BoardReading{};
    }
    [[nodiscard]] bool do_stage_is_hot() const override { return !cool_.is_high(); }

    static constexpr float kB_k = 3977;    // NTCLE100E3103, B25/85
    static constexpr int kLowest = 60;     // code of 160 degrees
    static constexpr int kHighest = 4030;  // of -46 degrees

    Converters& converters_;
    Factory factory_;
    std::uint8_t thermistor_;
    Pin cool_;
};

}  // namespace tricoil::stm32g4
