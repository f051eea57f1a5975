// The remote end of a serial line, at the line's bit rate.
#pragma once

#include <deque>
#include <functional>
#include <span>

#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {

class SerialLine {
public:
    SerialLine(Machine& machine, Usart& usart) : usart_(usart), next_(machine.events, [this] { deliver(); }) {
        usart.on_sent = [this](std::uint8_t byte) {
            if (on_byte) {
                on_byte(byte);
            }
        };
    }

    /// Queues bytes; one reaches the board per byte time. A byte that arrives while the board does not listen is lost.
    void send(std::span<const std::uint8_t> bytes) {
        outgoing_.insert(outgoing_.end(), bytes.begin(), bytes.end());
        if (!outgoing_.empty() && !next_.is_due()) {
            pace();
        }
    }
    [[nodiscard]] std::size_t queued() const { return outgoing_.size(); }

    /// Called with each byte that the board has sent.
    std::function<void(std::uint8_t)> on_byte;

private:
    void pace() { next_.in(std::max(usart_.byte_time(), ticks(1e-6))); }
    void deliver() {
        const std::uint8_t byte = outgoing_.front();
        outgoing_.pop_front();
        usart_.receive(byte);
        if (!outgoing_.empty()) {
            pace();
        }
    }

    Usart& usart_;
    Event next_;
    std::deque<std::uint8_t> outgoing_;
};

}  // namespace tricoil::virtual_board
