#include "drivers/stm32g4/usart/usart_port.hpp"

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usart;

constexpr std::uint32_t kErrors = ISR_FE | ISR_NE | ISR_ORE;
constexpr std::uint32_t kListening = CR1_FIFOEN | CR1_TE | CR1_RE | CR1_RXFNEIE | CR1_UE;
/// TEACK and REACK are set within one bit time.
constexpr std::uint32_t kStartPolls = 100'000;

}  // namespace

Status UsartPort::start() {
    const std::uint32_t divider = baud_divider(params_.kernel_clock_hz, params_.baud);
    if (divider == 0) {
        reason("serial line: the clock cannot be divided to the baud rate");
        return {StatusCode::invalid_argument, "invalid baud rate"};
    }
    registers_.CR1 = 0;  // the configuration registers may be written only while the USART is off
    registers_.CR2 = 0;
    registers_.CR3 = CR3_EIE;
    registers_.PRESC = 0;
    registers_.BRR = divider;
    registers_.CR1 = kListening & ~CR1_UE;
    registers_.ICR = ICR_FECF | ICR_NECF | ICR_ORECF;
    registers_.CR1 = kListening;
    const auto started = [this] { return (registers_.ISR & (ISR_TEACK | ISR_REACK)) == (ISR_TEACK | ISR_REACK); };
    if (!wait_until(started, kStartPolls, "USART does not start").ok()) {
        reason("serial line: the USART does not start; is its clock on?");
        registers_.CR1 = 0;
        return {StatusCode::device_lost, "USART does not start"};
    }
    return {};
}

void UsartPort::do_close() { registers_.CR1 = 0; }

void UsartPort::on_interrupt() {
    if ((registers_.CR1 & CR1_UE) == 0) {
        return;
    }
    const std::uint32_t flags = registers_.ISR;
    take_byte(flags);
    send_byte(flags);
}

void UsartPort::take_byte(std::uint32_t flags) {
    if ((flags & ISR_RXFNE) != 0) {
        const auto byte = static_cast<std::uint8_t>(registers_.RDR);
        // A byte with a framing error is dropped. A byte with a noise error may be correct and is kept. ORE: later bytes were
        // lost.
        if ((flags & ISR_FE) == 0 && !incoming().push(byte)) {
            interrupt_counts().note_dropped();
        }
    }
    if ((flags & (ISR_FE | ISR_NE)) != 0) {
        interrupt_counts().note_fault();
    }
    if ((flags & ISR_ORE) != 0) {
        interrupt_counts().note_dropped();
    }
    registers_.ICR = flags & kErrors;
}

void UsartPort::send_byte(std::uint32_t flags) {
    auto waiting = outgoing().front();
    if (!waiting.empty() && (flags & ISR_TXFNF) != 0) {
        registers_.TDR = waiting.front();
        outgoing().pop(1);
        waiting = outgoing().front();
    }
    registers_.CR1 = waiting.empty() ? kListening : kListening | CR1_TXFNFIE;
}

}  // namespace tricoil::stm32g4
