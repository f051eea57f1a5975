// Four ADCs with a common trigger.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/status.hpp"
#include "core/signal/sample_block.hpp"
#include "drivers/stm32g4/dma_channel.hpp"
#include "drivers/stm32g4/registers/adc.hpp"
#include "hal/clock.hpp"

namespace tricoil::stm32g4 {

/// Each trigger of TIM6 starts one conversion on each ADC; `oversampling` conversions add up to one sample. The buffer of each
/// ADC holds two blocks: one is written while the other is read.
class Converters {
public:
    static constexpr std::size_t kLongestBlock = 300;
    static constexpr unsigned kClockTicks = 4;  // core clock cycles per ADC clock cycle
    /// Time from a trigger until the voltage is held: 47.5 cycles of 42.5 MHz.
    static constexpr float kSampling_s = 47.5F / 42.5e6F;

    struct Input {
        AdcRegisters& adc;
        std::uint8_t channel;
        DmaChannel dma;
    };

    /// In the order of a Sample: sensor coils 1-3, reference. The DMA channel of sensor coil 3 has the lowest priority: its
    /// interrupt means that the block is complete on all channels.
    struct Parts {
        AdcCommonRegisters& common_12;
        AdcCommonRegisters& common_345;
        std::array<Input, kChannels> inputs;
    };

    Converters(const Parts& parts, const hal::Clock& clock) : parts_(parts), clock_(clock) {}

    /// Switches the converters on and calibrates them. The clocks must be on. ok; timed_out: a converter does not respond.
    Status begin();

    /// Starts waiting for triggers. `oversampling`: 2, 4, 8 or 16. `limit_codes`: largest deviation of a reference sample from
    /// the middle; beyond it the ADC's analog watchdog raises its interrupt. Requires a successful begin(). ok; timed_out.
    Status start(std::size_t block_samples, int oversampling, std::int32_t limit_codes);

    /// ok; timed_out: a conversion does not end.
    Status stop();

    // Internal inputs of ADC1, the converter of the reference channel (RM0440, "ADC connectivity").
    static constexpr std::uint8_t kThermometer = 16;
    static constexpr std::uint8_t kVoltageReference = 18;
    /// Code of an internal input or a pin of ADC1. Requires a successful begin(). Errors: not_ready (samples are being taken);
    /// timed_out.
    Result<std::uint16_t> measure_one(std::uint8_t channel);

    /// Call from the interrupt of the DMA channel of sensor coil 3: returns the completed halves of the buffer.
    struct BlockEnd {
        bool first_half = false;
        bool second_half = false;
        bool failed = false;
        bool uneven = false;  // a converter is out of step with the others: its samples are old
    };
    BlockEnd take_block_end();

    /// True if a sample was overwritten before the DMA read it, since the last call.
    bool take_overrun();

    /// Call from the interrupt of the reference channel's analog watchdog: clears and disables it. Returns false if another
    /// source raised the interrupt.
    bool take_over_limit();

    /// Copies one half of the buffer, 0 or 1, as signed codes.
    void copy(int half, std::span<Sample> to) const;

private:
    Status switch_on(AdcRegisters& adc);
    void pause(Microseconds time) const;
    bool await(const volatile std::uint32_t& target, std::uint32_t mask, std::uint32_t value) const;
    void configure(const Input& input, int oversampling) const;
    static void select(AdcRegisters& adc, std::uint8_t channel, std::uint32_t sampling);
    [[nodiscard]] AdcRegisters& reference() const { return parts_.inputs[kReferenceChannel].adc; }

    Parts parts_;
    const hal::Clock& clock_;
    std::size_t block_samples_ = 0;
    std::int32_t middle_ = 0;
    std::array<std::array<std::uint16_t, 2 * kLongestBlock>, kChannels> memory_{};
};

}  // namespace tricoil::stm32g4
