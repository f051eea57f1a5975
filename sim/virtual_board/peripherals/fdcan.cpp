#include "sim/virtual_board/peripherals/fdcan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

Fdcan::Fdcan(Machine& machine, int interrupt, std::function<double()> kernel_hz)
    : machine_(machine),
      interrupt_(interrupt),
      kernel_hz_(std::move(kernel_hz)),
      registers_{{0x00, 0x32141218}, {0x04, 0x87654321},  {kDbtp, 0x00000A33}, {0x10, 0},   {0x14, 0},
                 {kCccr, 1},         {kNbtp, 0x06000A03}, {0x20, 0},           {0x24, 0},   {0x28, 0xFFFF0000},
                 {0x2C, 0xFFFF},     {kEcr, 0},           {kPsr, 0x707},       {kTdcr, 0},  {kIr, 0},
                 {kIe, 0},           {kIls, 0},           {kIle, 0},           {kRxgfc, 0}, {kXidam, 0x1FFFFFFF},
                 {0x88, 0},          {kRxf0s, 0},         {kRxf0a, 0},         {kRxf1s, 0}, {kRxf1a, 0},
                 {kTxbc, 0},         {kTxfqs, 3},         {kTxbrp, 0},         {kTxbar, 0}, {kTxbcr, 0},
                 {kTxbto, 0},        {kTxbcf, 0},         {0xDC, 0},           {0xE0, 0},   {0xE4, 0},
                 {0xE8, 0},          {0x100, 0}},
      recovered_(machine.events, [this] {
          bus_off_ = false;
          send_errors_ = 0;
          receive_errors_ = 0;
          if (on_request) {
              on_request();
          }
      }) {
    reset();
}

bool Fdcan::is_on() const { return !is_set(registers_[kCccr], kInit) && !bus_off_; }

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

unsigned Fdcan::compensation_offset() const { return field(registers_[kTdcr], 8, 7); }

int Fdcan::next_buffer() const {
    int best = -1;
    for (int n = 0; n < static_cast<int>(kDepth); ++n) {
        if (!is_set(requests_, static_cast<unsigned>(n))) {
            continue;
        }
        const bool in_order = !is_set(registers_[kTxbc], 24);  // a FIFO sends in the order of requests
        const auto age = [&](int buffer) { return (static_cast<unsigned>(buffer) + kDepth - put_index_) % kDepth; };
        const auto id = [&](int buffer) {
            return memory_.words[(kBuffers + kElement * static_cast<unsigned>(buffer)) / 4] & 0x5FFFFFFFU;
        };
        if (best < 0 || (in_order ? age(n) < age(best) : id(n) < id(best))) {
            best = n;
        }
    }
    return best;
}

std::optional<CanFrame> Fdcan::waiting() const {
    const int n = is_on() ? next_buffer() : -1;
    if (n < 0) {
        return std::nullopt;
    }
    const std::uint32_t* element = memory_.words.data() + (kBuffers + kElement * static_cast<unsigned>(n)) / 4;
    CanFrame frame;
    frame.extended = is_set(element[0], 30);
    frame.id = frame.extended ? element[0] & 0x1FFFFFFFU : field(element[0], 18, 11);
    frame.fd = is_set(element[1], 21) && is_set(registers_[kCccr], kFdOn);
    frame.fast = frame.fd && is_set(element[1], 20) && is_set(registers_[kCccr], kSwitchOn);
    const unsigned size = std::min(bytes_of_code(field(element[1], 16, 4)), frame.fd ? 64U : 8U);
    for (unsigned i = 0; i < size; ++i) {
        frame.data.push_back(static_cast<std::uint8_t>(element[2 + i / 4] >> 8U * (i % 4)));
    }
    if (check_pins) {
        check_pins();
    }
    if (frame.fast && !is_set(registers_[kDbtp], kCompensation)) {
        throw RunFailure("FDCAN sends with bit rate switching, but transmitter delay compensation is off");
    }
    return frame;
}

void Fdcan::count_send_error(int change) {
    send_errors_ = std::max(0, send_errors_ + change);
    if (send_errors_ >= kOffAt) {
        bus_off_ = true;
        send_errors_ = 0;
        registers_.at(kCccr) |= 1U << kInit;
        interrupts_ |= 1U << kBusOff;
    } else if (change > 0 && send_errors_ >= kPassiveAt) {
        interrupts_ |= 1U << kErrorPassive;
    } else if (change > 0 && send_errors_ >= kWarningAt) {
        interrupts_ |= 1U << kWarning;
    }
    show_interrupt();
}

void Fdcan::sent(bool acknowledged) {
    const int n = next_buffer();
    if (n < 0) {
        return;
    }
    if (!acknowledged) {
        last_error_ = 3;
        if (send_errors_ < kPassiveAt) {  // an error-passive node does not count missing acknowledges
            count_send_error(8);
        }
        return;
    }
    requests_ &= ~(1U << n);
    registers_.at(kTxbto) |= 1U << n;
    interrupts_ |= 1U << kTransmitted | flag(requests_ == 0, kQueueEmpty);
    last_error_ = 0;
    count_send_error(-1);
}

void Fdcan::bus_error(bool while_sending) {
    last_error_ = 2;
    interrupts_ |= 1U << kProtocolError;
    if (while_sending) {
        count_send_error(8);
    } else {
        receive_errors_ = std::min(receive_errors_ + 1, 127);
    }
    show_interrupt();
}

std::uint32_t Fdcan::queue_status() const {
    unsigned pending = 0;
    for (unsigned n = 0; n < kDepth; ++n) {
        pending += is_set(requests_, n) ? 1 : 0;
    }
    const int next = next_buffer();
    return (kDepth - pending) | (next < 0 ? put_index_ : static_cast<unsigned>(next)) << 8U | put_index_ << 16U |
           flag(pending == kDepth, 21);
}

std::uint32_t Fdcan::protocol_status() const {
    return last_error_ | 1U << 3U | flag(send_errors_ >= kPassiveAt, 5) | flag(send_errors_ >= kWarningAt, 6) |
           flag(bus_off_, 7) | 7U << 8U;
}

void Fdcan::control(std::uint32_t value) {
    const std::uint32_t before = registers_[kCccr];
    const bool open = is_set(before, kInit) && is_set(before, kChange);
    std::uint32_t next = value;
    if (!is_set(value, kInit)) {
        next &= ~(1U << kChange);
    }
    constexpr std::uint32_t kAlways = 1U << kInit | 1U << kChange | 1U << 4U;
    if (!open && ((before ^ next) & ~kAlways & 0xFFFFU) != 0 && is_set(value, kInit)) {
        throw RunFailure("protected bits of CCCR are written without INIT and CCE");
    }
    registers_.at(kCccr) = next;
    if (is_set(before, kInit) && !is_set(next, kInit)) {
        const double nominal = nominal_hz();
        if (nominal <= 0 || !std::isfinite(nominal)) {
            throw RunFailure("FDCAN has no kernel clock");
        }
        if (bus_off_) {  // 129 times 11 recessive bits
            recovered_.in(ticks(129 * 11 / nominal));
        }
        if (on_request) {
            on_request();
        }
    }
    if (!is_set(before, kInit) && is_set(next, kInit)) {
        requests_ = 0;
    }
    if (!is_set(before, kChange) && is_set(next, kChange)) {
        for (Fifo& fifo : fifos_) {
            fifo.level = 0;
            fifo.get = 0;
            fifo.lost = false;
        }
        requests_ = 0;
        put_index_ = 0;
        registers_.at(kTxbto) = 0;
        registers_.at(kTxbcf) = 0;
    }
}

void Fdcan::show_interrupt() {
    const std::uint32_t wanted = interrupts_ & registers_[kIe];
    if (wanted != 0 && registers_[kIls] != 0) {
        throw RunFailure("interrupt line 1 is not in this model");
    }
    machine_.nvic.set_level(interrupt_, wanted != 0 && is_set(registers_[kIle], 0));
}

std::uint32_t Fdcan::read(std::uint32_t offset) {
    switch (offset) {
        case kEcr:
            return static_cast<std::uint32_t>(send_errors_) | static_cast<std::uint32_t>(receive_errors_) << 8U;
        case kPsr: {
            const std::uint32_t value = protocol_status();
            last_error_ = 7;
            return value;
        }
        case kIr:
            return interrupts_;
        case kRxf0s:
            return fifo_status(fifos_[0]);
        case kRxf1s:
            return fifo_status(fifos_[1]);
        case kTxfqs:
            return queue_status();
        case kTxbrp:
            return requests_;
        default:
            return registers_.at(offset);
    }
}

void Fdcan::write(std::uint32_t offset, std::uint32_t value) {
    const bool is_protected =
        offset == kDbtp || offset == kNbtp || offset == kTdcr || offset == kRxgfc || offset == kTxbc || offset == kXidam;
    if (is_protected && (registers_[kCccr] & 3U) != 3) {
        throw RunFailure("a protected register is written without INIT and CCE");
    }
    switch (offset) {
        case kCccr:
            control(value);
            break;
        case kIr:
            interrupts_ &= ~value;
            break;
        case kRxf0a:
            acknowledge(0, value & 7U);
            break;
        case kRxf1a:
            acknowledge(1, value & 7U);
            break;
        case kTxbar:
            for (unsigned n = 0; n < kDepth; ++n) {
                if (is_set(value, n)) {
                    if (is_set(requests_, n)) {
                        throw RunFailure(fmt::format("transmit buffer {} is requested while its last request is pending", n));
                    }
                    requests_ |= 1U << n;
                    put_index_ = (n + 1) % kDepth;
                    registers_.at(kTxbto) &= ~(1U << n);
                }
            }
            if (on_request) {
                on_request();
            }
            break;
        case kTxbcr:
            requests_ &= ~value;
            registers_.at(kTxbcf) |= value & 7U;
            interrupts_ |= 1U << kCancelled;
            break;
        default:
            registers_.at(offset) = value;
    }
    show_interrupt();
}

void Fdcan::reset() {
    registers_.reset();
    recovered_.cancel();
    fifos_ = {{{kFifo0}, {kFifo1}}};
    requests_ = 0;
    put_index_ = 0;
    interrupts_ = 0;
    send_errors_ = 0;
    receive_errors_ = 0;
    bus_off_ = false;
    last_error_ = 7;
}

}  // namespace tricoil::virtual_board
