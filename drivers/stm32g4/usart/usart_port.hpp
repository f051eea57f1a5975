// Protocol messages over a serial line.
#pragma once

#include "drivers/stm32g4/link/stream_port.hpp"
#include "drivers/stm32g4/registers/usart.hpp"

namespace tricoil::stm32g4 {

struct UsartParams {
    std::uint32_t kernel_clock_hz = 170'000'000;
    std::uint32_t baud = 921'600;  // 8 bits, no parity, 1 stop bit
};

/// Nearest divider for 16 samples per bit; 0 if it does not fit the register.
constexpr std::uint32_t baud_divider(std::uint32_t kernel_clock_hz, std::uint32_t baud) {
    const std::uint64_t divider = baud == 0 ? 0 : (std::uint64_t{kernel_clock_hz} + baud / 2) / baud;
    return divider >= 16 && divider <= 0xFFFF ? static_cast<std::uint32_t>(divider) : 0;
}

/// The board configures the peripheral's clock, its pins and its interrupt priority beforehand.
class UsartPort final : public StreamPort {
public:
    UsartPort(UsartRegisters& registers, InterruptLine interrupt, const hal::Clock& clock, UsartParams params = {})
        : StreamPort(interrupt, clock), registers_(registers), params_(params) {}

    /// Call from the interrupt handler: takes one byte, sends one byte.
    void on_interrupt();

private:
    Status start() override;
    void do_close() override;
    [[nodiscard]] bool is_up() const override { return true; }

    void take_byte(std::uint32_t flags);
    void send_byte(std::uint32_t flags);

    UsartRegisters& registers_;
    UsartParams params_;
};

}  // namespace tricoil::stm32g4
