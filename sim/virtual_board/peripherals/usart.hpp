// Universal asynchronous receiver/transmitter (RM0440 section 37), with its FIFOs of 8 bytes.
#pragma once

#include <deque>
#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

class Usart final : public Peripheral {
public:
    Usart(Machine& machine, int interrupt);

    /// Called with each sent byte, at the end of its stop bit.
    std::function<void(std::uint8_t)> on_sent;
    /// Throws RunFailure if the transmit pin is not configured.
    std::function<void()> check_pins;

    /// Receives a byte from the line.
    void receive(std::uint8_t byte, bool framing_error = false);
    [[nodiscard]] Ticks byte_time() const;
    [[nodiscard]] double baud() const;
    [[nodiscard]] bool listens() const;

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

private:
    static constexpr std::size_t kFifo = 8;
    struct Received {
        std::uint8_t byte;
        bool framing_error;
    };

    [[nodiscard]] std::uint32_t flags() const;
    [[nodiscard]] std::size_t room() const;
    void send();
    void sent();
    void show_interrupt();

    Machine& machine_;
    int interrupt_;
    RegisterFile<12> registers_;
    Event sent_;
    std::deque<std::uint8_t> outgoing_;  // front: the byte in the shift register, if sent_ is scheduled
    std::deque<Received> incoming_;
    bool overrun_ = false;
    bool framing_ = false;
};

}  // namespace tricoil::virtual_board
