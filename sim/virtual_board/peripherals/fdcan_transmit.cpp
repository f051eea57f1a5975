// Transmission of the CAN FD controller: buffers, cancellation, errors, internal loop-back, FIFO of transmit events.

#include <algorithm>
#include <utility>

#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/fdcan_registers.hpp"

namespace tricoil::virtual_board {

using namespace fdcan;

Ticks frame_time(const CanFrame& frame, double nominal_hz, double data_hz) {
    const double bytes = frame.remote ? 0 : static_cast<double>(frame.data.size());
    const double slow = (frame.extended ? 52 : 32) + 13;
    const double data = 8 * bytes + (frame.fd ? (bytes > 16 ? 35 : 31) : 20);
    return ticks(1.1 * (slow / nominal_hz + data / (frame.fast ? data_hz : nominal_hz)));
}

int Fdcan::next_buffer() const {
    const bool in_order = !is_set(registers_[kTxbc], 24);  // a FIFO sends in the order of requests
    const auto age = [&](unsigned buffer) { return (buffer + kDepth - state_.put_index) % kDepth; };
    const auto id = [&](unsigned buffer) { return memory_.words[(kBuffers + kElement * buffer) / 4] & 0x5FFFFFFFU; };
    int best = -1;
    for (unsigned n = 0; n < kDepth; ++n) {
        const auto first = static_cast<unsigned>(best);
        if (is_set(state_.requests, n) && (best < 0 || (in_order ? age(n) < age(first) : id(n) < id(first)))) {
            best = static_cast<int>(n);
        }
    }
    return best;
}

CanFrame Fdcan::frame_in(unsigned buffer) const {
    const std::uint32_t* element = memory_.words.data() + (kBuffers + kElement * buffer) / 4;
    CanFrame frame;
    frame.extended = is_set(element[0], 30);
    frame.remote = is_set(element[0], 29);
    frame.id = frame.extended ? element[0] & 0x1FFFFFFFU : field(element[0], 18, 11);
    frame.fd = is_set(element[1], 21) && is_set(registers_[kCccr], kFdOn) && !frame.remote;
    frame.fast = frame.fd && is_set(element[1], 20) && is_set(registers_[kCccr], kSwitchOn);
    const unsigned size = std::min(bytes_of_code(field(element[1], 16, 4)), frame.fd ? 64U : 8U);
    for (unsigned i = 0; i < size; ++i) {
        frame.data.push_back(frame.remote ? 0 : static_cast<std::uint8_t>(element[2 + i / 4] >> 8U * (i % 4)));
    }
    return frame;
}

void Fdcan::check_timing_of(const CanFrame& frame) const {
    fail_if(frame.fast && !compensates_delay() && data_sample_point() / kernel_hz_() < kLongestLoopDelayS,
            "FDCAN sends with bit rate switching, but transmitter delay compensation is off");
}

std::optional<CanFrame> Fdcan::waiting() const {
    const int n = is_on() && !is_set(registers_[kCccr], kMonitor) && !paused_.is_due() ? next_buffer() : -1;
    if (n < 0) {
        return std::nullopt;
    }
    check_pins();
    const CanFrame frame = frame_in(static_cast<unsigned>(n));
    check_timing_of(frame);
    return frame;
}

void Fdcan::win_arbitration() { state_.sending = next_buffer(); }

void Fdcan::request(std::uint32_t buffers) {
    for (unsigned n = 0; n < kDepth; ++n) {
        if (!is_set(buffers, n)) {
            continue;
        }
        fail_if(is_set(state_.requests, n), "transmit buffer {} is requested while its last request is pending", n);
        state_.requests |= 1U << n;
        state_.put_index = (n + 1) % kDepth;
        registers_.at(kTxbto) &= ~(1U << n);
        registers_.at(kTxbcf) &= ~(1U << n);
    }
    start_loop();
    on_request();
}

/// Loop-back: the controller sends to itself, without regard to the bus.
void Fdcan::start_loop() {
    const int n = runs() && is_loop() && !looped_.is_due() && !paused_.is_due() ? next_buffer() : -1;
    if (n >= 0) {
        state_.sending = n;
        looped_.in(frame_time(frame_in(static_cast<unsigned>(n)), nominal_hz(), data_hz()));
    }
}

void Fdcan::end_loop() {
    if (state_.sending >= 0) {
        const CanFrame frame = frame_in(static_cast<unsigned>(state_.sending));
        accept(frame);
        sent(true);
        if (!is_set(registers_[kCccr], kMonitor)) {
            on_loop(frame);
        }
    }
    start_loop();
}

void Fdcan::count_send_error(int change) {
    state_.send_errors = std::max(0, state_.send_errors + change);
    if (state_.send_errors >= kOffAt) {
        state_.bus_off = true;
        state_.send_errors = 0;
        registers_.at(kCccr) |= 1U << kInit;
        state_.interrupts |= 1U << kBusOff;
    } else if (change > 0 && state_.send_errors >= kPassiveAt) {
        state_.interrupts |= 1U << kErrorPassive;
    } else if (change > 0 && state_.send_errors >= kWarningAt) {
        state_.interrupts |= 1U << kWarning;
    }
    show_interrupt();
}

/// A transmission failed: it is repeated, unless software cancelled it or disabled retransmission.
void Fdcan::give_up(unsigned buffer) {
    const bool once = is_set(registers_[kCccr], kNoRetransmission);
    cancel(std::exchange(state_.cancelling, 0U) | (once ? 1U << buffer : 0U));
}

void Fdcan::sent(bool acknowledged) {
    const int n = std::exchange(state_.sending, -1);
    if (n < 0 || !is_set(state_.requests, static_cast<unsigned>(n))) {
        return;
    }
    if (!acknowledged) {
        give_up(static_cast<unsigned>(n));
        state_.last_error = 3;
        if (state_.send_errors < kPassiveAt) {  // an error-passive node does not count missing acknowledges
            count_send_error(8);
        }
        return;
    }
    const std::uint32_t buffer = 1U << n;
    state_.requests &= ~buffer;
    registers_.at(kTxbto) |= buffer;
    registers_.at(kTxbcf) |= std::exchange(state_.cancelling, 0U);  // sent although cancelled meanwhile: both flags
    state_.interrupts |= flag((registers_[kTxbtie] & buffer) != 0, kTransmitted) | flag(state_.requests == 0, kQueueEmpty);
    store_event(static_cast<unsigned>(n));
    if (is_set(registers_[kCccr], kPause)) {
        paused_.in(ticks(2 / nominal_hz()));
    }
    state_.last_error = 0;
    count_send_error(-1);
}

/// Ends requests that are not on the bus.
void Fdcan::cancel(std::uint32_t buffers) {
    const std::uint32_t ended = buffers & state_.requests;
    state_.requests &= ~ended;
    registers_.at(kTxbcf) |= ended;
    state_.interrupts |= flag((registers_[kTxbcie] & ended) != 0, kCancelled);
}

void Fdcan::bus_error(bool while_sending) {
    if (while_sending) {
        const int n = std::exchange(state_.sending, -1);
        give_up(static_cast<unsigned>(std::max(n, 0)));
    }
    state_.last_error = 2;
    state_.interrupts |= 1U << kProtocolError;
    if (while_sending) {
        count_send_error(8);
    } else {
        state_.receive_errors = std::min(state_.receive_errors + 1, 127);
    }
    show_interrupt();
}

/// The element's EFC bit asks for an event with its message marker.
void Fdcan::store_event(unsigned buffer) {
    const std::uint32_t* element = memory_.words.data() + (kBuffers + kElement * buffer) / 4;
    if (!is_set(element[1], 23)) {
        return;
    }
    if (events_.level == kDepth) {
        events_.lost = true;
        state_.interrupts |= 4U << kNewEvent;
        return;
    }
    std::uint32_t* event = memory_.words.data() + (events_.base + kEventBytes * ((events_.get + events_.level) % kDepth)) / 4;
    event[0] = element[0];
    event[1] = (element[1] & 0xFF3F0000U) | (state_.cancelling != 0 ? 2U : 1U) << 22U;
    ++events_.level;
    state_.interrupts |= 1U << kNewEvent | (events_.level == kDepth ? 2U << kNewEvent : 0U);
}

}  // namespace tricoil::virtual_board
