// Analog-to-digital converter (RM0440 section 21): regular and injected sequences by software or trigger, oversampling,
// offsets, watchdog 1.
#pragma once

#include <array>
#include <functional>
#include <optional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"
#include "sim/virtual_board/machine/time.hpp"
#include "sim/virtual_board/peripherals/adc_registers.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

/// Clock and internal inputs of a group of converters, ADCx_CCR.
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

struct AdcParams {
    unsigned request = 0;  // number at the DMA request multiplexer
    InterruptLine interrupt;
};

class Adc final : public RegisterPeripheral {
public:
    Adc(Machine& machine, Dma& dma, const AdcCommon& common, const AdcParams& params);

    /// External trigger, by its numbers in CFGR and JSQR: starts a conversion if the converter is configured for it.
    void trigger(unsigned source, unsigned injected_source);
    [[nodiscard]] Ticks sampling_time() const;
    /// Channel of the present conversion.
    [[nodiscard]] unsigned channel() const;
    /// Code, 0 to 4095, of the voltage that was held at this time; set by the board.
    std::function<std::uint32_t(Ticks held)> sample;
    /// Called with each result written to DR; may be empty.
    std::function<void(std::uint32_t)> on_result = [](std::uint32_t) {};

    /// Error of the first conversion after ADSTP, or after more than 1 ms without conversion or calibration (ES0430 2.7.9,
    /// 2.7.10). The errata give no magnitude; by default a quarter of the range.
    void set_first_error(std::uint32_t codes) { first_error_ = codes; }

    /// Emulates a broken converter: no conversion ends.
    void set_stuck(bool stuck) { stuck_ = stuck; }

    std::uint32_t read(std::uint32_t offset) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    void control(std::uint32_t value);
    void power(std::uint32_t value);
    void calibrate();
    void enable();
    void start();
    void stop();
    void convert();
    void convert_regular();
    void finish();
    void advance_sequence();
    void start_injected();
    void stop_injected();
    void inject();
    void resume();
    static bool is_triggered(std::uint32_t settings, unsigned source);
    [[nodiscard]] bool may_be_wrong() const;
    [[nodiscard]] bool is_powered() const;
    [[nodiscard]] bool is_by_software() const;
    [[nodiscard]] bool is_automatic() const { return is_set(registers_[adc::kCfgr], adc::kAutomatic); }
    /// The present group; any group: then results have no offset and no left alignment.
    [[nodiscard]] bool oversamples() const {
        return is_set(registers_[adc::kCfgr2], state_.injects ? adc::kOversampleInjected : adc::kOversampleRegular);
    }
    [[nodiscard]] bool oversamples_any() const {
        return is_set(registers_[adc::kCfgr2], adc::kOversampleRegular) ||
               is_set(registers_[adc::kCfgr2], adc::kOversampleInjected);
    }
    [[nodiscard]] bool is_aligned_left() const { return is_set(registers_[adc::kCfgr], adc::kAlignLeft) && !oversamples_any(); }
    [[nodiscard]] bool injects_or_waits() const { return state_.injects || is_set(state_.control, adc::kStartInjected); }
    [[nodiscard]] std::uint32_t corrected(std::uint32_t code) const;
    void store(std::uint32_t result);
    void store_regular(std::uint32_t result);
    void store_injected(std::uint32_t result);
    void check_watchdog(std::uint32_t result);
    void show_interrupt();
    [[nodiscard]] bool runs() const { return is_set(state_.control, adc::kStart); }
    [[nodiscard]] bool is_busy() const { return runs() || injects_or_waits(); }

    Machine& machine_;
    Dma& dma_;
    const AdcCommon& common_;
    AdcParams params_;
    Event ready_;
    Event calibrated_;
    Event finished_;
    std::optional<Ticks> regulated_from_;
    std::optional<Ticks> converted_;  // end of the last conversion or calibration; empty after ADSTP
    std::uint32_t first_error_ = 0x400;
    struct State {
        std::uint32_t control = 1U << 29U;  // DEEPPWD
        std::uint32_t flags = 0;
        struct Sum {
            std::uint32_t sum = 0;
            unsigned codes = 0;
        };
        std::array<Sum, 2> sums;     // of the oversampler: regular, injected
        unsigned rank = 0;           // in the regular sequence, from 0
        unsigned injected_rank = 0;  // in the injected sequence
        bool injects = false;        // an injected conversion runs
        bool postponed = false;      // a regular conversion follows the injected sequence
        bool is_ready = false;       // ADRDY was set; software may have cleared the flag since
        bool waits = false;          // a DMA request
    } state_;
    bool stuck_ = false;
};

}  // namespace tricoil::virtual_board
