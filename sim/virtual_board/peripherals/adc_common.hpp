// Clock and internal inputs of a group of converters (RM0440 section 21), ADCx_CCR.
#pragma once

#include <array>
#include <functional>

#include "sim/virtual_board/machine/register_file.hpp"
#include "sim/virtual_board/machine/time.hpp"

namespace tricoil::virtual_board {

class AdcCommon final : public RegisterPeripheral {
public:
    /// `bus`: ticks per cycle of the bus clock; `asynchronous`: of the clock that RCC selects, 0 if none.
    AdcCommon(std::function<Ticks()> bus, std::function<Ticks()> asynchronous)
        : RegisterPeripheral({{kCcr, 0, "CCR", 0x01FF0000, "DUAL@0-4 DELAY@8-11 DMACFG@13 MDMA@14-15"}}),
          bus_(std::move(bus)),
          asynchronous_(std::move(asynchronous)) {}

    /// Ticks per cycle of the converters' clock.
    [[nodiscard]] Ticks clock() const {
        const std::uint32_t mode = field(registers_[kCcr], 16, 2);
        if (mode != 0) {
            return bus_() << (mode - 1U);
        }
        constexpr std::array<unsigned, 16> kDividers{1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256, 256, 256, 256, 256};
        const Ticks cycle = asynchronous_();
        fail_if(cycle == 0, "the converters have no clock: set CKMODE here, or select a clock in RCC CCIPR");
        return cycle * kDividers[field(registers_[kCcr], 18, 4)];
    }
    // Internal inputs.
    [[nodiscard]] bool reference_is_on() const { return is_set(registers_[kCcr], 22); }
    [[nodiscard]] bool thermometer_is_on() const { return is_set(registers_[kCcr], 23); }
    [[nodiscard]] bool battery_is_on() const { return is_set(registers_[kCcr], 24); }

private:
    static constexpr std::uint32_t kCcr = 0x08;
    std::function<Ticks()> bus_;
    std::function<Ticks()> asynchronous_;
};

}  // namespace tricoil::virtual_board
