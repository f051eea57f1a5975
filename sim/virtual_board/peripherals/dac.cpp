#include "sim/virtual_board/peripherals/dac.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kCr = 0x00;
constexpr std::uint32_t kHold1 = 0x08;  // DHR12R1
constexpr std::uint32_t kHold2 = 0x14;  // DHR12R2
constexpr std::uint32_t kOutput1 = 0x2C;
constexpr std::uint32_t kOutput2 = 0x30;
constexpr std::uint32_t kSr = 0x34;
constexpr std::uint32_t kMcr = 0x3C;

constexpr unsigned kTriggered = 1;  // of channel 1; the bits of channel 2 are 16 positions higher
constexpr unsigned kDma = 12;
constexpr unsigned kUnderrun = 13;
constexpr unsigned kReady = 11;
constexpr double kFastBusHz = 160e6;

}  // namespace

Dac::Dac(Dma& dma, std::array<unsigned, 2> requests, std::function<double()> core_hz)
    : dma_(dma), requests_(requests), core_hz_(std::move(core_hz)), registers_{{kCr, 0},    {0x04, 0},     {kHold1, 0},
                                                                               {kHold2, 0}, {kOutput1, 0}, {kOutput2, 0},
                                                                               {kSr, 0},    {0x38, 0},     {kMcr, 0}} {}

void Dac::trigger(unsigned source) {
    for (unsigned n = 0; n < 2; ++n) {
        const std::uint32_t control = field(registers_[kCr], 16 * n, 16);
        if (!is_set(control, 0) || !is_set(control, kTriggered) || field(control, 2, 4) != source) {
            continue;
        }
        outputs_[n] = held_[n];
        if (is_set(control, kDma) && !underrun_[n]) {
            underrun_[n] = waits_[n];
            waits_[n] = !dma_.request(requests_[n]);
        }
    }
}

void Dac::hold(unsigned channel, std::uint32_t code) {
    held_[channel] = code & 0xFFFU;
    waits_[channel] = false;
    if (!is_set(registers_[kCr], 16 * channel + kTriggered)) {
        outputs_[channel] = held_[channel];
    }
}

std::uint32_t Dac::read(std::uint32_t offset) {
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

void Dac::write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case kHold1:
            hold(0, value);
            break;
        case kHold2:
            hold(1, value);
            break;
        case kSr:
            for (unsigned n = 0; n < 2; ++n) {
                underrun_[n] = underrun_[n] && !is_set(value, 16 * n + kUnderrun);
                waits_[n] = waits_[n] && underrun_[n];
            }
            break;
        case kCr:
            if ((value & 0x00C000C0U) != 0) {
                throw RunFailure("wave generation is not in this model");
            }
            if ((value & 0x00010001U) != 0 && core_hz_() > kFastBusHz && field(registers_[kMcr], 14, 2) != 2) {
                throw RunFailure("MCR.HFSEL must be 2 with a bus above 160 MHz");
            }
            registers_.at(kCr) = value;
            break;
        default:
            registers_.at(offset) = value;
    }
}

void Dac::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    if (bytes != 2 || (offset != kHold1 && offset != kHold2)) {
        Peripheral::write_narrow(offset, value, bytes);
    }
    write(offset, value);
}

void Dac::reset() {
    registers_.reset();
    held_ = {};
    outputs_ = {};
    waits_ = {};
    underrun_ = {};
}

}  // namespace tricoil::virtual_board
