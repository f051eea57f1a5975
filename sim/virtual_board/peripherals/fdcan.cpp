#include "sim/virtual_board/peripherals/fdcan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/virtual_board/peripherals/fdcan_registers.hpp"

namespace tricoil::virtual_board {

using namespace fdcan;

unsigned bytes_of_code(unsigned code) { return kBytes.at(code); }

unsigned code_of_bytes(std::size_t bytes) {
    unsigned code = 0;
    while (kBytes.at(code) < bytes) {
        ++code;
    }
    return code;
}

Fdcan::Fdcan(Machine& machine, std::array<int, 2> lines, std::function<double()> kernel_hz)
    : RegisterPeripheral(fdcan::registers()),
      machine_(machine),
      lines_(lines),
      kernel_hz_(std::move(kernel_hz)),
      recovered_(machine.events,
                 [this] {
                     state_.bus_off = false;
                     state_.send_errors = 0;
                     state_.receive_errors = 0;
                     on_request();
                 }),
      looped_(machine.events, [this] { end_loop(); }),
      paused_(machine.events, [this] {
          start_loop();
          on_request();
      }) {
    reset();
}

bool Fdcan::runs() const { return !is_set(registers_[kCccr], kInit) && !state_.bus_off && !machine_.events.is_frozen(); }

bool Fdcan::is_loop() const { return is_set(registers_[kTest], kLoopBack) && is_set(registers_[kCccr], kTestOn); }

double Fdcan::nominal_hz() const {
    const std::uint32_t t = registers_[kNbtp];
    return kernel_hz_() / (field(t, 16, 9) + 1) / (3 + field(t, 8, 8) + field(t, 0, 7));
}

double Fdcan::data_hz() const {
    const std::uint32_t t = registers_[kDbtp];
    return kernel_hz_() / (field(t, 16, 5) + 1) / (3 + field(t, 8, 5) + field(t, 4, 4));
}

unsigned Fdcan::data_sample_point() const {
    const std::uint32_t t = registers_[kDbtp];
    return (field(t, 16, 5) + 1) * (2 + field(t, 8, 5));
}

bool Fdcan::compensates_delay() const { return is_set(registers_[kDbtp], kCompensation); }

unsigned Fdcan::compensation_offset() const { return field(registers_[kTdcr], 8, 7); }

unsigned Fdcan::clock_divider() const {
    const std::uint32_t code = registers_[kCkdiv];
    return code == 0 ? 1 : 2 * code;
}

std::uint32_t Fdcan::queue_status() const {
    unsigned pending = 0;
    for (unsigned n = 0; n < kDepth; ++n) {
        pending += is_set(state_.requests, n) ? 1 : 0;
    }
    const int next = next_buffer();
    return (kDepth - pending) | (next < 0 ? state_.put_index : static_cast<unsigned>(next)) << 8U | state_.put_index << 16U |
           flag(pending == kDepth, 21);
}

std::uint32_t Fdcan::protocol_status() const {
    return state_.last_error | 1U << 3U | flag(state_.send_errors >= kPassiveAt, 5) | flag(state_.send_errors >= kWarningAt, 6) |
           flag(state_.bus_off, 7) | 7U << 8U;
}

void Fdcan::control(std::uint32_t value) {
    const std::uint32_t before = registers_[kCccr];
    const bool open = is_set(before, kInit) && is_set(before, kChange);
    std::uint32_t next = value;
    if (!is_set(value, kInit)) {
        next &= ~(1U << kChange);
    }
    constexpr std::uint32_t kAlways = 1U << kInit | 1U << kChange | 1U << 3U | 1U << 4U;
    fail_if(!open && ((before ^ next) & ~kAlways & 0xFFFFU) != 0 && is_set(value, kInit),
            "protected bits of CCCR are written without INIT and CCE");
    registers_.at(kCccr) = next;
    if (is_set(before, kInit) && !is_set(next, kInit)) {
        const double nominal = nominal_hz();
        fail_if(nominal <= 0 || !std::isfinite(nominal), "FDCAN has no kernel clock");
        if (state_.bus_off) {  // 129 times 11 recessive bits
            recovered_.in(ticks(129 * 11 / nominal));
        }
        start_loop();
        on_request();
    }
    if (!is_set(before, kInit) && is_set(next, kInit)) {
        state_.requests = 0;
        looped_.cancel();
    }
    if (!is_set(before, kChange) && is_set(next, kChange)) {
        for (Fifo* fifo : {&fifos_[0], &fifos_[1], &events_}) {
            *fifo = {fifo->base};
        }
        registers_.at(kHpms) = 0;
        state_.requests = 0;
        state_.put_index = 0;
        registers_.at(kTxbto) = 0;
        registers_.at(kTxbcf) = 0;
    }
}

void Fdcan::show_interrupt() {
    const std::uint32_t wanted = state_.interrupts & registers_[kIe];
    std::uint32_t on_line_1 = 0;
    for (unsigned n = 0; n < kGroups.size(); ++n) {
        on_line_1 |= is_set(registers_[kIls], n) ? kGroups[n] : 0;
    }
    machine_.nvic.set_level(lines_[0], (wanted & ~on_line_1) != 0 && is_set(registers_[kIle], 0));
    machine_.nvic.set_level(lines_[1], (wanted & on_line_1) != 0 && is_set(registers_[kIle], 1));
}

std::uint32_t Fdcan::read(std::uint32_t offset) {
    switch (offset) {
        case kEcr:
            return static_cast<std::uint32_t>(state_.send_errors) | static_cast<std::uint32_t>(state_.receive_errors) << 8U;
        case kPsr: {
            const std::uint32_t value = protocol_status();
            state_.last_error = 7;
            return value;
        }
        case kIr:
            return state_.interrupts;
        case kRxf0s:
            return fifo_status(fifos_[0]);
        case kRxf1s:
            return fifo_status(fifos_[1]);
        case kTxfqs:
            return queue_status();
        case kTxbrp:
            return state_.requests;
        case kTxefs:
            return fifo_status(events_);
        default:
            return registers_.at(offset);
    }
}

void Fdcan::apply(std::uint32_t offset, std::uint32_t value) {
    const bool is_protected = offset == kDbtp || offset == kNbtp || offset == kTdcr || offset == kRxgfc || offset == kTxbc ||
                              offset == kXidam || offset == kTest;
    fail_if(is_protected && (registers_[kCccr] & 3U) != 3, "a protected register is written without INIT and CCE");
    switch (offset) {
        case kCccr:
            control(value);
            break;
        case kIr:
            state_.interrupts &= ~value;
            for (unsigned n = 0; n < 2; ++n) {
                fifos_[n].lost = fifos_[n].lost && !is_set(value, kLost0 + 3 * n);
            }
            events_.lost = events_.lost && !is_set(value, kNewEvent + 2);
            break;
        case kRxf0a:
            acknowledge(fifos_[0], value & 7U);
            break;
        case kRxf1a:
            acknowledge(fifos_[1], value & 7U);
            break;
        case kTxefa:
            acknowledge(events_, value & 3U);
            break;
        case kTxbar:
            request(value);
            break;
        case kTxbcr:
            state_.cancelling |= value & flag(state_.sending >= 0, static_cast<unsigned>(std::max(state_.sending, 0)));
            cancel(value & ~state_.cancelling);
            break;
        default:
            registers_.at(offset) = value;
    }
    show_interrupt();
}

void Fdcan::reset() {
    registers_.reset();
    recovered_.cancel();
    looped_.cancel();
    paused_.cancel();
    fifos_ = {{{kFifo0}, {kFifo1}}};
    events_ = {kEvents};
    state_ = {};
    show_interrupt();
}

}  // namespace tricoil::virtual_board
