// Analog-to-digital converter (RM0440 section 21): one channel, triggered conversions, oversampling, analog watchdog 1.
#pragma once

#include <functional>
#include <optional>

#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

/// Clock of a group of converters, ADCx_CCR.
class AdcCommon final : public Peripheral {
public:
    /// Bus clock cycles per converter clock cycle.
    [[nodiscard]] unsigned divider() const;
    std::uint32_t read(std::uint32_t offset) override { return registers_.at(offset); }
    void write(std::uint32_t offset, std::uint32_t value) override { registers_.at(offset) = value; }
    void reset() override { registers_.reset(); }

private:
    RegisterFile<4> registers_{{0x00, 0}, {0x08, 0}, {0x0C, 0}};
};

struct AdcParams {
    unsigned request = 0;  // number at the DMA request multiplexer
    int interrupt = 0;
};

class Adc final : public Peripheral {
public:
    Adc(Machine& machine, Dma& dma, const AdcCommon& common, const AdcParams& params);

    /// External trigger `source`: starts a conversion if the converter is configured for it.
    void trigger(unsigned source);
    [[nodiscard]] bool is_converting() const { return converting_; }
    /// Time from the trigger until the voltage is held.
    [[nodiscard]] Ticks sampling_time() const;
    [[nodiscard]] Ticks conversion_time() const;
    [[nodiscard]] unsigned channel() const { return field(registers_[0x30], 6, 5); }
    /// Ends the conversion with this code, 0 to 4095.
    void finish(std::uint32_t code);

    /// Called with each result written to DR; may be empty.
    std::function<void(std::uint32_t)> on_result;

    /// Error of the first conversion after ADSTP, or after more than 1 ms without conversion or calibration (ES0430 2.7.9,
    /// 2.7.10). The errata give no magnitude; by default a quarter of the range.
    void set_first_error(std::uint32_t codes) { first_error_ = codes; }

    /// Emulates a broken converter: no conversion ends.
    void set_stuck(bool stuck) { stuck_ = stuck; }

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

private:
    void control(std::uint32_t value);
    [[nodiscard]] bool may_be_wrong() const;
    void store_result(std::uint32_t result);
    void check_watchdog(std::uint32_t result);
    void show_interrupt();
    [[nodiscard]] bool runs() const { return is_set(control_, 2); }

    Machine& machine_;
    Dma& dma_;
    const AdcCommon& common_;
    AdcParams params_;
    RegisterFile<49> registers_;
    Event ready_;
    Event calibrated_;
    std::optional<Ticks> regulated_from_;
    std::optional<Ticks> converted_;  // end of the last conversion or calibration; empty after ADSTP
    std::uint32_t first_error_ = 0x400;
    std::uint32_t control_ = 0;
    std::uint32_t flags_ = 0;
    std::uint32_t sum_ = 0;
    unsigned summed_ = 0;
    bool converting_ = false;
    bool stuck_ = false;
};

}  // namespace tricoil::virtual_board
