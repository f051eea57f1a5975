// Supply voltage and chip temperature from internal inputs of a converter.
#pragma once

#include "drivers/stm32g4/converters.hpp"
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

    SupplyMonitor(Converters& converters, const Factory& factory) : converters_(converters), factory_(factory) {}

    [[nodiscard]] static constexpr hal::BoardReading reading_of(int reference, int thermometer, const Factory& factory) {
        const int span = factory.at_130_degrees - factory.at_30_degrees;
        if (reference <= 0 || span <= 0) {
            return {};
        }
        const int supply_mv = kFactory_mv * factory.reference / reference;
        if (supply_mv > kLargest_mv) {  // above the absolute maximum rating of the chip: the reading is wrong
            return {};
        }
        const int at_factory_supply = thermometer * supply_mv / kFactory_mv;
        const int cdeg = 3000 + (at_factory_supply - factory.at_30_degrees) * 10'000 / span;
        return {static_cast<std::uint16_t>(supply_mv), static_cast<std::int16_t>(cdeg)};
    }

private:
    static constexpr int kFactory_mv = 3000;
    static constexpr int kLargest_mv = 5000;

    [[nodiscard]] hal::BoardReading do_read() override {
        const auto reference = converters_.measure_inside(Converters::kVoltageReference);
        const auto thermometer = converters_.measure_inside(Converters::kThermometer);
        return reference.ok() && thermometer.ok() ? reading_of(*reference, *thermometer, factory_) : hal::BoardReading{};
    }

    Converters& converters_;
    Factory factory_;
};

}  // namespace tricoil::stm32g4
