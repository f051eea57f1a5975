// Reception of the CAN FD controller: acceptance filters, the two FIFOs, messages of high priority.
#include <algorithm>

#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/fdcan_registers.hpp"

namespace tricoil::virtual_board {

using namespace fdcan;

namespace {

/// Action of a filter element: 1, 2: FIFO 0, 1; 3: reject; 4: priority; 5, 6: priority and FIFO 0, 1.
int fifo_of(std::uint32_t action) { return action == 1 || action == 5 ? 0 : action == 2 || action == 6 ? 1 : -1; }
bool is_priority(std::uint32_t action) { return action >= 4 && action <= 6; }

}  // namespace

/// `type` 3 of extended filters ignores the mask XIDAM, which applies to the others.
bool Fdcan::matches(const CanFrame& frame, std::uint32_t type, std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t id = frame.extended && type != 3 ? frame.id & registers_[kXidam] : frame.id;
    switch (type) {
        case 0:
            return id >= a && id <= b;
        case 1:
            return id == a || id == b;
        case 2:
            return (id & b) == (a & b);
        default:
            return frame.extended && id >= a && id <= b;
    }
}

Fdcan::Accepted Fdcan::filter(const CanFrame& frame) const {
    const std::uint32_t global = registers_[kRxgfc];
    if (frame.remote && is_set(global, frame.extended ? 0 : 1)) {
        return {};
    }
    const std::uint32_t count = field(global, frame.extended ? 24 : 16, frame.extended ? 4 : 5);
    for (std::uint32_t n = 0; n < count; ++n) {
        std::uint32_t action = 0;
        bool matched = false;
        if (frame.extended) {
            const std::uint32_t* f = memory_.words.data() + kExtendedFilters / 4 + 2 * n;
            action = f[0] >> 29U;
            matched = matches(frame, f[1] >> 30U, f[0] & 0x1FFFFFFFU, f[1] & 0x1FFFFFFFU);
        } else {
            const std::uint32_t f = memory_.words[kStandardFilters / 4 + n];
            action = field(f, 27, 3);
            matched = f >> 30U != 3 && matches(frame, f >> 30U, field(f, 16, 11), field(f, 0, 11));
        }
        if (action != 0 && matched) {
            return {fifo_of(action), n, is_priority(action), frame.extended};
        }
    }
    const std::uint32_t rest = field(global, frame.extended ? 2 : 4, 2);
    return {rest < 2 ? static_cast<int>(rest) : -1, 0x80, false, frame.extended};
}

void Fdcan::receive(const CanFrame& frame) {
    if (!is_on() || (frame.fd && !is_set(registers_[kCccr], kFdOn))) {
        return;
    }
    accept(frame);
    state_.receive_errors = std::max(0, state_.receive_errors - 1);
}

void Fdcan::accept(const CanFrame& frame) {
    const Accepted accepted = filter(frame);
    if (accepted.priority) {
        note_priority(accepted);
    }
    if (accepted.fifo >= 0) {
        put(static_cast<unsigned>(accepted.fifo), frame, accepted.filter);
    }
}

void Fdcan::note_priority(const Accepted& accepted) {
    const bool stored = accepted.fifo >= 0;
    const Fifo& fifo = fifos_[stored ? static_cast<std::size_t>(accepted.fifo) : 0];
    const std::uint32_t index = (fifo.get + fifo.level) % kDepth;
    registers_.at(kHpms) = flag(accepted.extended, 15) | accepted.filter << 8U |
                           (stored ? (2U + static_cast<std::uint32_t>(accepted.fifo)) << 6U | index : 0U);
    state_.interrupts |= 1U << kPriority;
    show_interrupt();
}

void Fdcan::put(unsigned n, const CanFrame& frame, std::uint32_t matched) {
    Fifo& fifo = fifos_[n];
    const unsigned shift = kNewMessage0 + 3 * n;
    if (fifo.level == kDepth) {
        const bool overwrites = is_set(registers_[kRxgfc], n == 0 ? 9 : 8);
        fifo.lost = true;
        state_.interrupts |= 4U << shift;
        if (!overwrites) {
            show_interrupt();
            return;
        }
        fifo.get = (fifo.get + 1) % kDepth;
        --fifo.level;
    }
    std::uint32_t* element = memory_.words.data() + (fifo.base + kElement * ((fifo.get + fifo.level) % kDepth)) / 4;
    element[0] = (frame.extended ? frame.id | 1U << 30U : frame.id << 18U) | flag(frame.remote, 29);
    element[1] = code_of_bytes(frame.data.size()) << 16U | flag(frame.fast, 20) | flag(frame.fd, 21) | matched << 24U;
    std::fill_n(element + 2, 16, 0);
    for (std::size_t i = 0; i < frame.data.size(); ++i) {
        element[2 + i / 4] |= static_cast<std::uint32_t>(frame.data[i]) << 8U * (i % 4);
    }
    ++fifo.level;
    state_.interrupts |= 1U << shift | (fifo.level == kDepth ? 2U << shift : 0);
    show_interrupt();
}

void Fdcan::acknowledge(Fifo& fifo, std::uint32_t index) {
    const unsigned count = (index + kDepth - fifo.get) % kDepth + 1;
    fail_if(count > fifo.level, "more FIFO elements are acknowledged than are stored");
    fifo.level -= count;
    fifo.get = (fifo.get + count) % kDepth;
}

std::uint32_t Fdcan::fifo_status(const Fifo& fifo) {
    return fifo.level | fifo.get << 8U | (fifo.get + fifo.level) % kDepth << 16U | flag(fifo.level == kDepth, 24) |
           flag(fifo.lost, 25);
}

}  // namespace tricoil::virtual_board
