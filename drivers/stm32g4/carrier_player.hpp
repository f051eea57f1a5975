// Three sines from three DAC channels, by timer and DMA.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "drivers/stm32g4/carrier_table.hpp"
#include "drivers/stm32g4/dma_channel.hpp"
#include "drivers/stm32g4/registers/dac.hpp"

namespace tricoil::stm32g4 {

/// Every trigger of TIM6 outputs the next value of each table, so the carriers have a constant phase relative to the sampling,
/// which has the same trigger.
class CarrierPlayer {
public:
    static constexpr std::size_t kLongestTable = 400;

    struct Parts {
        DacRegisters& pair;    // channels 1 and 2: carriers 1 and 2
        DacRegisters& single;  // channel 1: carrier 3
        std::array<DmaChannel, kSourceCoils> dma;
        std::uint32_t output;  // of both DACs: dac::MCR_MODE1_...
    };

    explicit CarrierPlayer(const Parts& parts) : parts_(parts) {}

    /// Sets the outputs to their middle: no carrier. The clocks must be on. ok; timed_out: a DAC does not become ready.
    Status begin();

    /// Loads the plan's carriers, which start with the next trigger; `updates_per_sample` triggers make one sample. In TDM all
    /// three outputs play the same carrier at the full amplitude; in FDM each amplitude is smaller, so that the sum of the
    /// currents stays in range. ok; invalid_argument: a carrier whose period is longer than kLongestTable updates.
    Status load(const signal::AcquisitionPlan& plan, int updates_per_sample, float amplitude_codes);

    /// Changes the amplitude of the loaded carriers; takes about half a millisecond, in which both amplitudes are output.
    void set_amplitude(float amplitude_codes);

    /// Sets the outputs to their middle.
    void stop();

    /// True if a DAC value was not ready in time since the last call.
    bool take_underrun();

private:
    void set_channels(std::uint32_t channel1) const;

    Parts parts_;
    std::array<CarrierPeriod, kSourceCoils> periods_{};  // of the loaded carriers
    std::array<float, kSourceCoils> shares_{};           // of the amplitude
    std::array<std::array<std::uint16_t, kLongestTable>, kSourceCoils> tables_{};
};

}  // namespace tricoil::stm32g4
