// Digital-to-analog converter with up to two channels (RM0440 section 22).
#pragma once

#include <array>
#include <functional>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

class Dac final : public RegisterPeripheral {
public:
    /// `requests`: the channels' numbers at the DMA request multiplexer. `core_hz`: checked against HFSEL.
    Dac(Machine& machine, Dma& dma, InterruptLine interrupt, std::array<unsigned, 2> requests, std::function<double()> core_hz);

    /// Trigger `source`.
    void trigger(unsigned source);
    /// False: the output of the channel floats.
    [[nodiscard]] bool is_on(unsigned channel) const { return is_set(registers_[0x00], 16 * channel); }
    /// True if the output is connected only to on-chip peripherals, unbuffered.
    [[nodiscard]] bool is_inside(unsigned channel) const { return field(registers_[0x3C], 16 * channel, 3) == 3; }
    /// Output code, 0 to 4095.
    [[nodiscard]] std::uint32_t code(unsigned channel) const { return outputs_[channel]; }

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    void hold(unsigned channel, std::uint32_t code);
    void hold_aligned(std::uint32_t offset, std::uint32_t value);
    void trigger_channel(unsigned channel);
    void show_interrupt();

    Machine& machine_;
    Dma& dma_;
    InterruptLine interrupt_;
    std::array<unsigned, 2> requests_;
    std::function<double()> core_hz_;
    std::array<std::uint32_t, 2> held_{};
    std::array<std::uint32_t, 2> outputs_{};
    std::array<bool, 2> waits_{};  // for the DMA
    std::array<bool, 2> underrun_{};
};

}  // namespace tricoil::virtual_board
