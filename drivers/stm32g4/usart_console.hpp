// Console on a serial line.
#pragma once

#include "drivers/stm32g4/registers/usart.hpp"
#include "drivers/stm32g4/wait.hpp"
#include "hal/console.hpp"

namespace tricoil::stm32g4 {

/// Sends only, and waits for every byte: for boards with little output. The board configures the peripheral's clock and its pin.
class UsartConsole final : public hal::Console {
public:
    explicit UsartConsole(UsartRegisters& registers) : registers_(registers) {}

    /// 8 bits, no parity, 1 stop bit.
    void begin(std::uint32_t kernel_clock_hz, std::uint32_t baud) {
        registers_.CR1 = 0;
        registers_.BRR = (kernel_clock_hz + baud / 2) / baud;
        registers_.CR1 = usart::CR1_FIFOEN | usart::CR1_TE | usart::CR1_UE;
    }

private:
    static constexpr std::uint32_t kPollsPerByte = 1'000'000;  // a byte at 9600 baud takes 1 ms

    Status do_write(std::string_view text) override {
        for (const char c : text) {
            const auto has_room = [this] { return (registers_.ISR & usart::ISR_TXFNF) != 0; };
            if (!wait_until(has_room, kPollsPerByte, "").ok()) {
                return {StatusCode::device_lost, "the serial line does not accept bytes"};
            }
            registers_.TDR = static_cast<std::uint8_t>(c);
        }
        return {};
    }

    UsartRegisters& registers_;
};

}  // namespace tricoil::stm32g4
