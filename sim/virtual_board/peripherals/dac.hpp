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
        : RegisterPeripheral({{kCr, 0, "CR", 0x7FFF7FFF},
                              {kSoftware, 0, "SWTRIGR", 0x30003},
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
                              {kTrim, 0x100010, "CCR", 0x1F001F},
                              {0x40, 0, "SHSR1", 0x3FF},  // of sample and hold: DOR is the output in each MODE
                              {0x44, 0, "SHSR2", 0x3FF},
                              {0x48, 0x10001, "SHHR", 0x03FF03FF},
                              {0x4C, 0x10001, "SHRR", 0x00FF00FF},
                              {kSawtooth, 0, "STR1", 0xFFFF1FFF},
                              {0x5C, 0, "STR2", 0xFFFF1FFF},
                              {kSawtoothTriggers, 0, "STMODR", 0x0F0F0F0F},
                              {kMcr, 0, "MCR", 0x0007C007, "DMADOUBLE1@8 SINFORMAT1@9 DMADOUBLE2@24 SINFORMAT2@25"}}),
          machine_(machine),
          dma_(dma),
          interrupt_(interrupt),
          requests_(requests),
          core_hz_(std::move(core_hz)) {}

    /// Trigger `source`; 0 is software, with the bits of SWTRIGR in `which`.
    void trigger(unsigned source, std::uint32_t which = kAllBits) {
        for (unsigned n = 0; n < 2; ++n) {
            const std::uint32_t control = field(registers_[kCr], 16 * n, 16);
            if (!is_set(control, 0) || !is_set(control, kTriggered)) {
                continue;
            }
            if (field(control, kWave, 2) == kSawtoothWave) {
                advance_sawtooth(n, source, which >> n);
            } else if (is_set(which, n) && field(control, 2, 4) == source) {
                trigger_channel(n);
            }
        }
    }
    /// False: the output of the channel floats.
    [[nodiscard]] bool is_on(unsigned channel) const { return is_set(registers_[0x00], 16 * channel); }
    /// True if the output is connected only to on-chip peripherals, unbuffered.
    [[nodiscard]] bool is_inside(unsigned channel) const { return field(registers_[0x3C], 16 * channel, 3) == 3; }
    /// Output code, 0 to 4095.
    [[nodiscard]] std::uint32_t code(unsigned channel) const { return channels_[channel].output; }

    std::uint32_t read(std::uint32_t offset) override {
        const Channel& channel = channels_[offset == kHold2 || offset == kOutput2 ? 1 : 0];
        if (offset == kHold1 || offset == kHold2) {
            return channel.held;
        }
        if (offset == kOutput1 || offset == kOutput2) {
            return channel.output;
        }
        return offset == kSr ? flags(0) | flags(1) << 16U : registers_.at(offset);
    }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        if (offset < kHold1 || offset > 0x28 || (offset & 3U) != 0) {
            Peripheral::write_narrow(offset, value, bytes);
        }
        write(offset, value);
    }
    void reset() override {
        registers_.reset();
        channels_ = {};
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
    static constexpr std::uint32_t kTrim = 0x38;  // CCR
    static constexpr std::uint32_t kMcr = 0x3C;
    static constexpr std::uint32_t kSawtooth = 0x58;  // STR1
    static constexpr std::uint32_t kSawtoothTriggers = 0x60;
    static constexpr unsigned kWave = 6;
    static constexpr std::uint32_t kSawtoothWave = 3;
    static constexpr unsigned kCalibrates = 14;  // CEN; in SR: CAL_FLAG
    static constexpr std::uint32_t kBestTrim = 16;
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
                trigger(0, value);
                break;
            case kSr:
                for (unsigned n = 0; n < 2; ++n) {
                    channels_[n].underrun = channels_[n].underrun && !is_set(value, 16 * n + kUnderrun);
                    channels_[n].waits = channels_[n].waits && channels_[n].underrun;
                }
                break;
            case kCr:
                fail_if((value & 0x00010001U) != 0 && core_hz_() > kFastBusHz && field(registers_[kMcr], 14, 2) != 2,
                        "MCR.HFSEL must be 2 with a bus above 160 MHz");
                for (const std::uint32_t wave : {field(value, kWave, 2), field(value, 16 + kWave, 2)}) {
                    fail_if(wave == 1 || wave == 2, "CR.WAVE: noise and triangle are not in this model");
                }
                registers_.at(kCr) = value;
                break;
            default:
                registers_.at(offset) = value;
        }
        show_interrupt();
    }
    void hold(unsigned channel, std::uint32_t code) {
        channels_[channel].held = code & 0xFFFU;
        channels_[channel].waits = false;
        if (!is_set(registers_[kCr], 16 * channel + kTriggered)) {
            channels_[channel].output = channels_[channel].held;
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
        channels_[channel].output = channels_[channel].held;
        if (is_set(registers_[kCr], 16 * channel + kDma) && !channels_[channel].underrun) {
            channels_[channel].underrun = channels_[channel].waits;
            channels_[channel].waits = !dma_.request(requests_[channel]);
            if (channels_[channel].underrun) {
                show_interrupt();
            }
        }
    }
    /// Reset and step have triggers of their own. `which`: bit 0 reset, bit 16 step.
    void advance_sawtooth(unsigned channel, unsigned source, std::uint32_t which) {
        const std::uint32_t triggers = field(registers_[kSawtoothTriggers], 16 * channel, 16);
        const std::uint32_t shape = registers_[kSawtooth + 4 * channel];
        std::uint32_t& value = channels_[channel].sawtooth;
        if (is_set(which, 0) && field(triggers, 0, 4) == source) {
            value = field(shape, 0, 12) << 4U;
        }
        if (is_set(which, 16) && field(triggers, 8, 4) == source) {
            value += is_set(shape, 12) ? field(shape, 16, 16) : -field(shape, 16, 16);
        }
        channels_[channel].output = field(value, 4, 12);
    }
    /// Of SR.
    [[nodiscard]] std::uint32_t flags(unsigned channel) const {
        const bool calibrates = is_set(registers_[kCr], 16 * channel + kCalibrates);
        return flag(is_on(channel), kReady) | flag(channels_[channel].underrun, kUnderrun) |
               flag(calibrates && field(registers_[kTrim], 16 * channel, 5) >= kBestTrim, kCalibrates);
    }
    void show_interrupt() {
        const std::uint32_t cr = registers_[kCr];
        const bool wanted =
            (channels_[0].underrun && is_set(cr, kUnderrun)) || (channels_[1].underrun && is_set(cr, 16 + kUnderrun));
        machine_.nvic.set_level(interrupt_, wanted);
    }

    Machine& machine_;
    Dma& dma_;
    InterruptLine interrupt_;
    std::array<unsigned, 2> requests_;
    std::function<double()> core_hz_;
    struct Channel {
        std::uint32_t held = 0;
        std::uint32_t output = 0;
        std::uint32_t sawtooth = 0;  // 12 bits and 4 bits of fraction
        bool waits = false;          // for the DMA
        bool underrun = false;
    };
    std::array<Channel, 2> channels_{};
};

}  // namespace tricoil::virtual_board
