// The chip's peripherals that the tracker does not use: for any other firmware.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sim/virtual_board/peripherals/crc.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {

/// Pin with the alternate function of a serial port's transmitter.
struct TransmitPin {
    char port;
    unsigned pin;
    unsigned function;
};

/// `attach`: puts a device on the bus; its clock is one bit of an enable register of RCC.
using Attach = std::function<void(const std::string& name, std::uint32_t base, std::uint32_t size, Peripheral& device,
                                  std::uint32_t enable_register, unsigned bit)>;

/// Timers and serial ports of the whole chip, and small units.
class GeneralPeripherals {
public:
    /// `is_pin`: true if the pin is configured with this function.
    GeneralPeripherals(Machine& machine, Dma& dma, Rcc& rcc, const std::function<bool(const TransmitPin&)>& is_pin);

    void attach(const Attach& attach);

    /// By number, for example 6 for TIM6. Throws std::out_of_range.
    Timer& timer(unsigned number);
    /// USART1 to USART3, UART4, UART5 by number, LPUART1 as 0. Throws std::out_of_range.
    Usart& serial(unsigned number);

private:
    std::vector<std::unique_ptr<Timer>> timers_;
    std::vector<std::unique_ptr<Usart>> serials_;
    Crc crc_;
};

}  // namespace tricoil::virtual_board
