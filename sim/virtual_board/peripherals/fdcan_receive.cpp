// Reception of the CAN FD controller: acceptance filters and the two FIFOs.
#include <algorithm>

#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/fdcan_registers.hpp"

namespace tricoil::virtual_board {

using namespace fdcan;

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
    const unsigned shift = kNewMessage0 + 3 * n;
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
        throw RunFailure("more FIFO elements are acknowledged than are stored");
    }
    fifo.level -= count;
    fifo.get = (fifo.get + count) % kDepth;
}

std::uint32_t Fdcan::fifo_status(const Fifo& fifo) const {
    return fifo.level | fifo.get << 8U | (fifo.get + fifo.level) % kDepth << 16U | flag(fifo.level == kDepth, 24) |
           flag(fifo.lost, 25);
}

}  // namespace tricoil::virtual_board
