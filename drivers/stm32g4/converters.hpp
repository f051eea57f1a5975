// Four ADCs that convert at the same triggers.
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

/// Each trigger of TIM6 is one conversion on each; `oversampling` of them add up to a sample. Two blocks a converter lie in
/// memory: one is being written while the other one is read.
class Converters {
public:
    static constexpr std::size_t kLongestBlock = 300;
    /// From a trigger until the voltage is held: 47.5 cycles of 42.5 MHz.
    static constexpr float kSampling_s = 47.5F / 42.5e6F;

    struct Input {
        AdcRegisters& adc;
        std::uint8_t channel;
        DmaChannel dma;
    };

    /// In the order of a Sample: sensor coils 1-3, reference. The DMA channel of sensor 3 comes last in priority: its interrupt
    /// tells that a block is whole.
    struct Parts {
        AdcCommonRegisters& common_12;
        AdcCommonRegisters& common_345;
        std::array<Input, kChannels> inputs;
    };

    Converters(const Parts& parts, const hal::Clock& clock) : parts_(parts), clock_(clock) {}

    /// Switches on and calibrates. Clocks are on. ok; timed_out: a converter does not follow.
    Status begin();

    /// Waits for triggers. `oversampling`: 2, 4, 8 or 16. `limit_codes`: the reference's sample may be that far from the middle
    /// before the converter's watchdog interrupts. begin() has succeeded. ok; timed_out.
    Status start(std::size_t block_samples, int oversampling, std::int32_t limit_codes);

    /// ok; timed_out: a conversion does not end.
    Status stop();

    /// From the interrupt of sensor 3's DMA channel: what of the memory is whole.
    struct BlockEnd {
        bool first_half = false;
        bool second_half = false;
        bool failed = false;
        bool uneven = false;  // a converter did not keep step with the others: its samples are old ones
    };
    BlockEnd take_block_end();

    /// Whether a sample was overwritten before it was fetched, since the last call.
    bool take_overrun();

    /// From the reference's watchdog's interrupt: quiets it. False: it was another one.
    bool take_over_limit();

    /// One half of the memory, 0 or 1, as signed codes.
    void copy(int half, std::span<Sample> to) const;

private:
    Status switch_on(AdcRegisters& adc);
    void pause(Microseconds time) const;
    bool await(const volatile std::uint32_t& target, std::uint32_t mask, std::uint32_t value) const;
    void configure(const Input& input, int oversampling) const;
    [[nodiscard]] AdcRegisters& reference() const { return parts_.inputs[kReferenceChannel].adc; }

    Parts parts_;
    const hal::Clock& clock_;
    std::size_t block_samples_ = 0;
    std::int32_t middle_ = 0;
    std::array<std::array<std::uint16_t, 2 * kLongestBlock>, kChannels> memory_{};
};

}  // namespace tricoil::stm32g4
