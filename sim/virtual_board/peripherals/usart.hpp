// Universal asynchronous receiver/transmitter (RM0440 sections 37 and 38), with its FIFOs of 8 bytes. The other end
// of the line is always ready (CTS), and does not wait (RTS).
#pragma once

#include <deque>
#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

struct UsartParams {
    InterruptLine interrupt;
    unsigned receive_request = 0;  // numbers at the DMA request multiplexer
    unsigned send_request = 0;
    bool low_power = false;                    // LPUART
    std::function<Ticks()> clock;              // ticks per cycle of the kernel clock; 0: off
    std::function<void()> check_pins = [] {};  // throws RunFailure if no transmit pin is configured
};

class Usart final : public RegisterPeripheral {
public:
    Usart(Machine& machine, Dma& dma, UsartParams params);

    /// Called with each sent byte, at the end of its stop bit.
    std::function<void(std::uint8_t)> on_sent = [](std::uint8_t) {};

    /// Receives a byte from the line.
    void receive(std::uint8_t byte, bool framing_error = false);
    [[nodiscard]] Ticks byte_time() const;
    [[nodiscard]] double baud() const;
    [[nodiscard]] bool listens() const;

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr std::size_t kFifo = 8;
    struct Received {
        std::uint32_t word;
        bool framing_error;
    };

    [[nodiscard]] Ticks bit_time() const;
    [[nodiscard]] unsigned data_bits() const;
    [[nodiscard]] double stop_bits() const;
    [[nodiscard]] std::uint32_t flags() const;
    [[nodiscard]] std::size_t room() const;
    [[nodiscard]] std::size_t queued() const { return outgoing_.size() - (sent_.is_due() ? 1 : 0); }
    void control(std::uint32_t value);
    void put(std::uint32_t value);
    std::uint32_t take();
    void wake_up();
    void send();
    void sent();
    void serve_dma();
    void show_interrupt();

    Machine& machine_;
    Dma& dma_;
    UsartParams params_;
    Event sent_;
    Event idle_;                         // the line has been idle for one frame
    std::deque<std::uint8_t> outgoing_;  // front: the byte in the shift register, if sent_ is scheduled
    std::deque<Received> incoming_;
    std::uint32_t raised_ = 0x40;  // flags of ISR that ICR clears; at first: TC
    bool serving_dma_ = false;
};

}  // namespace tricoil::virtual_board
