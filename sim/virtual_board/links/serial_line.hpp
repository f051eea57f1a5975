// The remote end of the Nucleo's serial line, at the bit rate of the port that uses it.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {

class SerialLine {
public:
    /// A port that can use the line. is_connected: true if its pins are connected to the line.
    struct Port {
        Usart* usart;
        std::function<bool()> is_connected;
    };

    SerialLine(Machine& machine, std::vector<Port> ports)
        : ports_(std::move(ports)),
          next_(
              machine.events, [this] { deliver(); }, Event::Clock::always) {
        for (const Port& port : ports_) {
            port.usart->on_sent = [this, &port](std::uint8_t byte) {
                if (on_byte && port.is_connected()) {
                    on_byte(byte);
                }
            };
        }
    }
    SerialLine(const SerialLine&) = delete;
    SerialLine& operator=(const SerialLine&) = delete;

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
    void pace() {
        Ticks time = ticks(1e-6);
        for (const Port& port : ports_) {
            time = port.usart->listens() && port.is_connected() ? std::max(time, port.usart->byte_time()) : time;
        }
        next_.in(time);
    }
    void deliver() {
        const std::uint8_t byte = outgoing_.front();
        outgoing_.pop_front();
        for (const Port& port : ports_) {
            if (port.is_connected()) {
                port.usart->receive(byte);
            }
        }
        if (!outgoing_.empty()) {
            pace();
        }
    }

    std::vector<Port> ports_;
    Event next_;
    std::deque<std::uint8_t> outgoing_;
};

}  // namespace tricoil::virtual_board
