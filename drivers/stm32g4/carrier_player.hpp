// Three sines from three DAC channels, by timer and DMA.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "drivers/stm32g4/dma_channel.hpp"
#include "drivers/stm32g4/registers/dac.hpp"

namespace tricoil::stm32g4 {

/// Every trigger of TIM6 puts the next value of each table out, so that carriers keep their phase to whatever else it triggers.
class CarrierPlayer {
public:
    static constexpr std::size_t kLongestTable = 400;

    struct Parts {
        DacRegisters& pair;    // channels 1 and 2: carriers 1 and 2
        DacRegisters& single;  // channel 1: carrier 3
        std::array<DmaChannel, kSourceCoils> dma;
        std::uint32_t output;  // of both: dac::MCR_MODE1_...
    };

    explicit CarrierPlayer(const Parts& parts) : parts_(parts) {}

    /// Outputs at their middle: no carrier. Clocks are on. ok; timed_out: a converter does not become ready.
    Status begin();

    /// Loads the plan's carriers, to start with the next trigger; `updates_per_sample` triggers make one sample. In TDM all three
    /// play the same at the full amplitude, in FDM each less, so that the sum of their currents stays in range. ok;
    /// invalid_argument: a carrier that only repeats after more than kLongestTable updates.
    Status load(const signal::AcquisitionPlan& plan, int updates_per_sample, float amplitude_codes);

    /// Outputs at their middle again.
    void stop();

    /// Whether a value came late since the last call.
    bool take_underrun();

private:
    void set_channels(std::uint32_t channel1) const;

    Parts parts_;
    std::array<std::array<std::uint16_t, kLongestTable>, kSourceCoils> tables_{};
};

}  // namespace tricoil::stm32g4
