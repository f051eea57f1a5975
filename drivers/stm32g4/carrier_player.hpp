// The currents' sines from three DAC channels, by timer and DMA: one carrier per channel, in two bands two.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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
    struct Parts {
        DacRegisters& pair;    // channels 1 and 2: carriers 1 and 2
        DacRegisters& single;  // channel 1: carrier 3
        std::array<DmaChannel, kSourceCoils> dma;
        std::uint32_t output;             // of both DACs: dac::MCR_MODE1_...
        std::span<std::uint16_t> memory;  // for the tables of all three channels; must outlive the player
    };

    /// Values of the tables for a plan.
    static constexpr std::size_t table_values(const signal::AcquisitionPlan& plan, int updates_per_sample) {
        std::size_t values = 0;
        for (std::size_t n = 0; n < kSourceCoils; ++n) {
            values += static_cast<std::size_t>(period_of(plan, updates_per_sample, n).updates);
        }
        return values;
    }

    explicit CarrierPlayer(const Parts& parts) : parts_(parts) {}

    /// Sets the outputs to their middle: no carrier. The clocks must be on. ok; timed_out: a DAC does not become ready.
    Status begin();

    /// Loads the plan's carriers, which start with the next trigger; `updates_per_sample` triggers make one sample. In TDM all
    /// three outputs play the same carrier at the full amplitude; in FDM and in two bands each amplitude is smaller, so that the
    /// sum of the currents stays in range. ok; invalid_argument: the tables of one period need more memory.
    Status load(const signal::AcquisitionPlan& plan, int updates_per_sample, float amplitude_codes);

    /// Changes the amplitude of the loaded carriers. Until it returns, both amplitudes are output. It must take less than a
    /// block: some 50 instructions a value, 0.8 ms for the 2,600 values of two bands.
    void set_amplitude(float amplitude_codes);

    /// Sets the outputs to their middle.
    void stop();

    /// True if a DAC value was not ready in time since the last call.
    bool take_underrun();

private:
    static constexpr CarrierPeriod period_of(const signal::AcquisitionPlan& plan, int updates_per_sample, std::size_t channel) {
        const int low_cycles = plan.has_low_band() ? plan.window_cycles[kMaxCarriers - kSourceCoils + channel] : 0;
        return shortest_period(plan.window_samples * updates_per_sample, plan.window_cycles[channel], low_cycles);
    }
    void set_channels(std::uint32_t channel1) const;

    Parts parts_;
    /// Carriers of one channel.
    struct Channel {
        CarrierPeriod period;
        float share = 0;  // amplitude of the high carrier, relative to a single carrier
        std::span<std::uint16_t> table{};
    };
    std::array<Channel, kSourceCoils> channels_{};
};

}  // namespace tricoil::stm32g4
