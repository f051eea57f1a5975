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
    Dac(Machine& machine, Dma& dma, InterruptLine interrupt, std::array<unsigned, 2> requests, std::function<double()> core_hz)
        : RegisterPeripheral({{kCr, 0, "CR", 0x3F3F3F3F, "WAVE1@6-7 CEN1@14 WAVE2@22-23 CEN2@30"},
                              {kSoftware, 0, "SWTRIGR", 0x3, "SWTRIGB1@16 SWTRIGB2@17"},
                              {kHold1, 0, "DHR12R1", 0xFFFF, "DACC1DHRB@16-27"},
                              {0x0C, 0, "DHR12L1", 0xFFFF, "DACC1DHRB@20-31"},
                              {0x10, 0, "DHR8R1", 0xFF, "DACC1DHRB@8-15"},
                              {kHold2, 0, "DHR12R2", 0xFFFF, "DACC2DHRB@16-27"},
                              {0x18, 0, "DHR12L2", 0xFFFF, "DACC2DHRB@20-31"},
                              {0x1C, 0, "DHR8R2", 0xFF, "DACC2DHRB@8-15"},
                              {kHoldBoth, 0, "DHR12RD", kAllBits},
                              {0x24, 0, "DHR12LD", kAllBits},
                              {0x28, 0, "DHR8RD", 0xFFFF},
                              {kOutput1, 0, "DOR1", kAllBits},
                              {kOutput2, 0, "DOR2", kAllBits},
                              {kSr, 0, "SR", kAllBits},
                              {0x38, 0, "CCR", 0, "OTRIM1@0-4 OTRIM2@16-20"},
                              {0x40, 0, "SHSR1", 0x3FF},  // of sample and hold: DOR is the output in each MODE
                              {0x44, 0, "SHSR2", 0x3FF},
                              {0x48, 0x10001, "SHHR", 0x03FF03FF},
                              {0x4C, 0x10001, "SHRR", 0x00FF00FF},
                              {0x58, 0, "STR1", 0xFFFF1FFF},  // of the sawtooth, which CR.WAVE refuses
                              {0x5C, 0, "STR2", 0xFFFF1FFF},
                              {0x60, 0, "STMODR", 0x0F0F0F0F},
                              {kMcr, 0, "MCR", 0x0007C007, "DMADOUBLE1@8 SINFORMAT1@9 DMADOUBLE2@24 SINFORMAT2@25"}}),
          machine_(machine),
          dma_(dma),
          interrupt_(interrupt),
          requests_(requests),
          core_hz_(std::move(core_hz)) {}

    /// Trigger `source`.
    void trigger(unsigned source) {
        for (unsigned n = 0; n < 2; ++n) {
            const std::uint32_t control = field(registers_[kCr], 16 * n, 16);
            if (!is_set(control, 0) || !is_set(control, kTriggered) || field(control, 2, 4) != source) {
                continue;
            }
            trigger_channel(n);
        }
    }
    /// False: the output of the channel floats.
    [[nodiscard]] bool is_on(unsigned channel) const { return is_set(registers_[0x00], 16 * channel); }
    /// True if the output is connected only to on-chip peripherals, unbuffered.
    [[nodiscard]] bool is_inside(unsigned channel) const { return field(registers_[0x3C], 16 * channel, 3) == 3; }
    /// Output code, 0 to 4095.
    [[nodiscard]] std::uint32_t code(unsigned channel) const { return outputs_[channel]; }

    std::uint32_t read(std::uint32_t offset) override {
        switch (offset) {
            case kHold1:
                return held_[0];
            case kHold2:
                return held_[1];
            case kOutput1:
                return outputs_[0];
            case kOutput2:
                return outputs_[1];
            case kSr:
                return flag(is_on(0), kReady) | flag(is_on(1), 16 + kReady) | flag(underrun_[0], kUnderrun) |
                       flag(underrun_[1], 16 + kUnderrun);
            default:
                return registers_.at(offset);
        }
    }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        if (offset < kHold1 || offset > 0x28 || (offset & 3U) != 0) {
            Peripheral::write_narrow(offset, value, bytes);
        }
        write(offset, value);
    }
    void reset() override {
        registers_.reset();
        held_ = {};
        outputs_ = {};
        waits_ = {};
        underrun_ = {};
        show_interrupt();
    }

private:
    static constexpr std::uint32_t kCr = 0x00;
    static constexpr std::uint32_t kSoftware = 0x04;  // SWTRIGR
    static constexpr std::uint32_t kHold1 = 0x08;     // DHR12R1; left-aligned and 8-bit registers follow
    static constexpr std::uint32_t kHold2 = 0x14;     // DHR12R2
    static constexpr std::uint32_t kHoldBoth = 0x20;  // DHR12RD
    static constexpr std::uint32_t kOutput1 = 0x2C;
    static constexpr std::uint32_t kOutput2 = 0x30;
    static constexpr std::uint32_t kSr = 0x34;
    static constexpr std::uint32_t kMcr = 0x3C;
    static constexpr unsigned kTriggered = 1;  // of channel 1; the bits of channel 2 are 16 positions higher
    static constexpr unsigned kDma = 12;
    static constexpr unsigned kUnderrun = 13;
    static constexpr unsigned kReady = 11;
    static constexpr double kFastBusHz = 160e6;

    void apply(std::uint32_t offset, std::uint32_t value) override {
        if (offset >= kHold1 && offset <= 0x28) {
            hold_aligned(offset, value);
            return;
        }
        switch (offset) {
            case kSoftware:
                for (unsigned n = 0; n < 2; ++n) {
                    const std::uint32_t control = field(registers_[kCr], 16 * n, 16);
                    if (is_set(value, n) && is_set(control, 0) && is_set(control, kTriggered) && field(control, 2, 4) == 0) {
                        trigger_channel(n);
                    }
                }
                break;
            case kSr:
                for (unsigned n = 0; n < 2; ++n) {
                    underrun_[n] = underrun_[n] && !is_set(value, 16 * n + kUnderrun);
                    waits_[n] = waits_[n] && underrun_[n];
                }
                break;
            case kCr:
                fail_if((value & 0x00010001U) != 0 && core_hz_() > kFastBusHz && field(registers_[kMcr], 14, 2) != 2,
                        "MCR.HFSEL must be 2 with a bus above 160 MHz");
                registers_.at(kCr) = value;
                break;
            default:
                registers_.at(offset) = value;
        }
        show_interrupt();
    }
    void hold(unsigned channel, std::uint32_t code) {
        held_[channel] = code & 0xFFFU;
        waits_[channel] = false;
        if (!is_set(registers_[kCr], 16 * channel + kTriggered)) {
            outputs_[channel] = held_[channel];
        }
    }
    /// Registers of a channel: right-aligned, left-aligned, 8 bits; then those of both channels.
    void hold_aligned(std::uint32_t offset, std::uint32_t value) {
        const std::uint32_t alignment = (offset - kHold1) / 4 % 3;
        const unsigned width = alignment == 2 ? 8 : 16;
        const auto code = [alignment](std::uint32_t bits) {
            return alignment == 1 ? bits >> 4U : alignment == 2 ? bits << 4U : bits;
        };
        if (offset >= kHoldBoth) {
            hold(0, code(field(value, 0, width)));
            hold(1, code(field(value, width, width)));
        } else {
            hold(offset < kHold2 ? 0 : 1, code(value));
        }
    }
    void trigger_channel(unsigned channel) {
        outputs_[channel] = held_[channel];
        if (is_set(registers_[kCr], 16 * channel + kDma) && !underrun_[channel]) {
            underrun_[channel] = waits_[channel];
            waits_[channel] = !dma_.request(requests_[channel]);
            if (underrun_[channel]) {
                show_interrupt();
            }
        }
    }
    void show_interrupt() {
        const std::uint32_t cr = registers_[kCr];
        const bool wanted = (underrun_[0] && is_set(cr, kUnderrun)) || (underrun_[1] && is_set(cr, 16 + kUnderrun));
        machine_.nvic.set_level(interrupt_, wanted);
    }

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
