#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr3 = 0x08;
constexpr std::uint32_t kBrr = 0x0C;
constexpr std::uint32_t kRqr = 0x18;
constexpr std::uint32_t kIsr = 0x1C;
constexpr std::uint32_t kIcr = 0x20;
constexpr std::uint32_t kRdr = 0x24;
constexpr std::uint32_t kTdr = 0x28;
constexpr std::uint32_t kPresc = 0x2C;

constexpr unsigned kEnable = 0;
constexpr unsigned kReceive = 2;
constexpr unsigned kTransmit = 3;
constexpr unsigned kFifoOn = 29;
constexpr unsigned kFramingError = 1;
constexpr unsigned kOverrun = 3;
constexpr unsigned kNotEmpty = 5;  // flag in ISR; interrupt enable in CR1
constexpr unsigned kComplete = 6;
constexpr unsigned kNotFull = 7;
constexpr int kBitsOfAByte = 10;

}  // namespace

Usart::Usart(Machine& machine, int interrupt)
    : machine_(machine),
      interrupt_(interrupt),
      registers_{{kCr1, 0}, {0x04, 0}, {kCr3, 0}, {kBrr, 0}, {0x10, 0}, {0x14, 0},
                 {kRqr, 0}, {kIsr, 0}, {kIcr, 0}, {kRdr, 0}, {kTdr, 0}, {kPresc, 0}},
      sent_(machine.events, [this] { sent(); }) {}

Ticks Usart::byte_time() const { return kBitsOfAByte * Ticks{registers_[kBrr]} * machine_.cpu.ticks_per_cycle(); }

double Usart::baud() const { return kBitsOfAByte * static_cast<double>(kTicksPerSecond) / static_cast<double>(byte_time()); }

bool Usart::listens() const { return is_set(registers_[kCr1], kEnable) && is_set(registers_[kCr1], kReceive); }

std::size_t Usart::room() const { return is_set(registers_[kCr1], kFifoOn) ? kFifo : 1; }

void Usart::receive(std::uint8_t byte, bool framing_error) {
    if (!listens()) {
        return;
    }
    if (incoming_.size() >= room()) {
        overrun_ = true;
    } else {
        incoming_.push_back({byte, framing_error});
        framing_ = framing_ || (framing_error && incoming_.size() == 1);
    }
    show_interrupt();
}

void Usart::send() {
    if (!outgoing_.empty() && !sent_.is_due() && is_set(registers_[kCr1], kTransmit)) {
        if (check_pins) {
            check_pins();
        }
        sent_.in(byte_time());
    }
}

void Usart::sent() {
    const std::uint8_t byte = outgoing_.front();
    outgoing_.pop_front();
    if (on_sent) {
        on_sent(byte);
    }
    send();
    show_interrupt();
}

std::uint32_t Usart::flags() const {
    const std::uint32_t cr1 = registers_[kCr1];
    const std::size_t queued = outgoing_.size() - (sent_.is_due() ? 1 : 0);
    return flag(framing_, kFramingError) | flag(overrun_, kOverrun) | flag(!incoming_.empty(), kNotEmpty) |
           flag(outgoing_.empty(), kComplete) | flag(queued < room(), kNotFull) |
           flag(is_set(cr1, kEnable) && is_set(cr1, kTransmit), 21) | flag(listens(), 22) | flag(queued == 0, 23);
}

void Usart::show_interrupt() {
    const std::uint32_t cr1 = registers_[kCr1];
    const std::uint32_t now = flags();
    const bool errors = framing_ && is_set(registers_[kCr3], 0);
    const bool wanted = (now & cr1 & (1U << kNotEmpty | 1U << kComplete | 1U << kNotFull)) != 0 || errors ||
                        (overrun_ && (is_set(cr1, kNotEmpty) || is_set(registers_[kCr3], 0)));
    machine_.nvic.set_level(interrupt_, is_set(cr1, kEnable) && wanted);
}

std::uint32_t Usart::read(std::uint32_t offset) {
    if (offset == kIsr) {
        return flags();
    }
    if (offset != kRdr) {
        return registers_.at(offset);
    }
    std::uint32_t byte = 0;
    if (!incoming_.empty()) {
        byte = incoming_.front().byte;
        incoming_.pop_front();
        framing_ = framing_ || (!incoming_.empty() && incoming_.front().framing_error);
    }
    show_interrupt();
    return byte;
}

void Usart::write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case kTdr:
            if (!is_set(flags(), kNotFull) || !is_set(registers_[kCr1], kEnable)) {
                throw RunFailure("TDR is written while it is full or the USART is off");
            }
            outgoing_.push_back(static_cast<std::uint8_t>(value));
            send();
            break;
        case kIcr:
            overrun_ = overrun_ && !is_set(value, kOverrun);
            framing_ = framing_ && !is_set(value, kFramingError);
            break;
        case kCr1:
            if (is_set(value, kEnable) && registers_[kBrr] < 16) {
                throw RunFailure("the USART is enabled without a baud rate");
            }
            if ((value & (1U << 12U | 1U << 28U | 1U << 10U | 1U << 15U)) != 0 || registers_[kPresc] != 0) {
                throw RunFailure("only 8 data bits, no parity, 16 times oversampling and no prescaler are in this model");
            }
            registers_.at(kCr1) = value;
            if (!is_set(value, kEnable)) {
                outgoing_.clear();
                incoming_.clear();
                sent_.cancel();
            }
            break;
        case kBrr:
            if (is_set(registers_[kCr1], kEnable)) {
                throw RunFailure("BRR is written while the USART is on");
            }
            registers_.at(kBrr) = value;
            break;
        case kRqr:
            if (is_set(value, 3)) {
                incoming_.clear();
            }
            break;
        case kCr3:
            if ((value & 0xC0U) != 0) {
                throw RunFailure("DMA for the USART is not in this model");
            }
            registers_.at(kCr3) = value;
            break;
        default:
            registers_.at(offset) = value;
    }
    show_interrupt();
}

void Usart::reset() {
    registers_.reset();
    outgoing_.clear();
    incoming_.clear();
    sent_.cancel();
    overrun_ = false;
    framing_ = false;
}

}  // namespace tricoil::virtual_board
