#include "sim/virtual_board/peripherals/fdcan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kDbtp = 0x0C;
constexpr std::uint32_t kCccr = 0x18;
constexpr std::uint32_t kNbtp = 0x1C;
constexpr std::uint32_t kEcr = 0x40;
constexpr std::uint32_t kPsr = 0x44;
constexpr std::uint32_t kTdcr = 0x48;
constexpr std::uint32_t kIr = 0x50;
constexpr std::uint32_t kIe = 0x54;
constexpr std::uint32_t kIls = 0x58;
constexpr std::uint32_t kIle = 0x5C;
constexpr std::uint32_t kRxgfc = 0x80;
constexpr std::uint32_t kXidam = 0x84;
constexpr std::uint32_t kRxf0s = 0x90;
constexpr std::uint32_t kRxf0a = 0x94;
constexpr std::uint32_t kRxf1s = 0x98;
constexpr std::uint32_t kRxf1a = 0x9C;
constexpr std::uint32_t kTxbc = 0xC0;
constexpr std::uint32_t kTxfqs = 0xC4;
constexpr std::uint32_t kTxbrp = 0xC8;
constexpr std::uint32_t kTxbar = 0xCC;
constexpr std::uint32_t kTxbcr = 0xD0;
constexpr std::uint32_t kTxbto = 0xD4;
constexpr std::uint32_t kTxbcf = 0xD8;

// Offsets in the message memory.
constexpr std::uint32_t kStandardFilters = 0x000;
constexpr std::uint32_t kExtendedFilters = 0x070;
constexpr std::uint32_t kFifo0 = 0x0B0;
constexpr std::uint32_t kFifo1 = 0x188;
constexpr std::uint32_t kBuffers = 0x278;
constexpr std::uint32_t kElement = 72;
constexpr unsigned kDepth = 3;

constexpr unsigned kInit = 0;
constexpr unsigned kChange = 1;
constexpr unsigned kFdOn = 8;
constexpr unsigned kSwitchOn = 9;
constexpr unsigned kCompensation = 23;

constexpr unsigned kNew0 = 0;  // new, full, lost; the bits of FIFO 1 are three positions higher
constexpr unsigned kTransmitted = 7;
constexpr unsigned kCancelled = 8;
constexpr unsigned kQueueEmpty = 9;
constexpr unsigned kErrorPassive = 17;
constexpr unsigned kWarning = 18;
constexpr unsigned kBusOff = 19;
constexpr unsigned kProtocolError = 21;

constexpr int kPassiveAt = 128;
constexpr int kWarningAt = 96;
constexpr int kOffAt = 256;
constexpr std::array<unsigned, 16> kBytes{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

}  // namespace

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

int Fdcan::fifo_for(const CanFrame& frame, std::uint32_t& matched) const {
    const std::uint32_t global = registers_[kRxgfc];
    const auto choice = [](std::uint32_t action) { return action == 1 || action == 5 ? 0 : action == 2 || action == 6 ? 1 : -1; };
    const auto matches = [&](std::uint32_t type, std::uint32_t a, std::uint32_t b) {
        switch (type) {
            case 0:
                return frame.id >= a && frame.id <= b;
            case 1:
                return frame.id == a || frame.id == b;
            case 2:
                return (frame.id & b) == (a & b);
            default:
                return frame.extended && frame.id >= a && frame.id <= b;
        }
    };
    const std::uint32_t count = field(global, frame.extended ? 24 : 16, frame.extended ? 4 : 5);
    for (std::uint32_t n = 0; n < count; ++n) {
        matched = n;
        if (frame.extended) {
            const std::uint32_t* f = memory_.words.data() + kExtendedFilters / 4 + 2 * n;
            if (f[0] >> 29U != 0 && matches(f[1] >> 30U, f[0] & 0x1FFFFFFFU, f[1] & 0x1FFFFFFFU)) {
                return choice(f[0] >> 29U);
            }
        } else {
            const std::uint32_t f = memory_.words[kStandardFilters / 4 + n];
            if (field(f, 27, 3) != 0 && f >> 30U != 3 && matches(f >> 30U, field(f, 16, 11), field(f, 0, 11))) {
                return choice(field(f, 27, 3));
            }
        }
    }
    matched = 0x80;
    const std::uint32_t rest = field(global, frame.extended ? 2 : 4, 2);
    return rest < 2 ? static_cast<int>(rest) : -1;
}

void Fdcan::receive(const CanFrame& frame) {
    if (!is_on() || (frame.fd && !is_set(registers_[kCccr], kFdOn))) {
        return;
    }
    std::uint32_t matched = 0;
    const int fifo = fifo_for(frame, matched);
    if (fifo >= 0) {
        put(static_cast<unsigned>(fifo), frame, matched);
    }
    receive_errors_ = std::max(0, receive_errors_ - 1);
}

void Fdcan::put(unsigned n, const CanFrame& frame, std::uint32_t matched) {
    Fifo& fifo = fifos_[n];
    const unsigned shift = kNew0 + 3 * n;
    if (fifo.level == kDepth) {
        const bool overwrites = is_set(registers_[kRxgfc], n == 0 ? 9 : 8);
        fifo.lost = true;
        interrupts_ |= 4U << shift;
        if (!overwrites) {
            show_interrupt();
            return;
        }
        fifo.get = (fifo.get + 1) % kDepth;
        --fifo.level;
    }
    std::uint32_t* element = memory_.words.data() + (fifo.base + kElement * ((fifo.get + fifo.level) % kDepth)) / 4;
    element[0] = frame.extended ? frame.id | 1U << 30U : frame.id << 18U;
    element[1] = code_of_bytes(frame.data.size()) << 16U | flag(frame.fast, 20) | flag(frame.fd, 21) | matched << 24U;
    std::fill_n(element + 2, 16, 0);
    for (std::size_t i = 0; i < frame.data.size(); ++i) {
        element[2 + i / 4] |= static_cast<std::uint32_t>(frame.data[i]) << 8U * (i % 4);
    }
    ++fifo.level;
    interrupts_ |= 1U << shift | (fifo.level == kDepth ? 2U << shift : 0);
    show_interrupt();
}

void Fdcan::acknowledge(unsigned n, std::uint32_t index) {
    Fifo& fifo = fifos_[n];
    const unsigned count = (index + kDepth - fifo.get) % kDepth + 1;
    if (count > fifo.level) {
        throw RunFailure("acknowledge of more FIFO elements than are stored");
    }
    fifo.level -= count;
    fifo.get = (fifo.get + count) % kDepth;
}

std::uint32_t Fdcan::fifo_status(const Fifo& fifo) const {
    return fifo.level | fifo.get << 8U | (fifo.get + fifo.level) % kDepth << 16U | flag(fifo.level == kDepth, 24) |
           flag(fifo.lost, 25);
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
