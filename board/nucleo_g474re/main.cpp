// Composition root of the tracker board.
#include <string_view>

#include "board/cortex_m/program.hpp"
#include "board/nucleo_g474re/image_header.hpp"
#include "board/nucleo_g474re/interrupts.hpp"
#include "board/nucleo_g474re/pins.hpp"
#include "drivers/stm32g4/clocks.hpp"
#include "drivers/stm32g4/gpio.hpp"
#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "drivers/stm32g4/registers/usart.hpp"
#include "drivers/stm32g4/timer_clock.hpp"

namespace {

using namespace tricoil;
using namespace tricoil::stm32g4;
namespace board_pins = tricoil::nucleo_g474re;

RccRegisters& rcc_registers = peripheral<RccRegisters>(kRccBase);
TimerClock device_clock(peripheral<TimRegisters>(kTim2Base));

stm32g4::Pin pin(board_pins::Pin where) {
    const auto port = static_cast<std::uintptr_t>(where.port - 'A');
    return {peripheral<GpioRegisters>(kGpioABase + port * kGpioPortBytes), where.number};
}

void say(std::string_view text) {
    auto& usart = peripheral<UsartRegisters>(kUsart2Base);
    for (const char c : text) {
        while ((usart.ISR & usart::ISR_TXFNF) == 0) {
        }
        usart.TDR = static_cast<std::uint8_t>(c);
    }
}

}  // namespace

extern "C" {
void nmi_handler() { tricoil::board::halt(); }
void tick_handler() {}
void over_current_handler() {}
void block_end_handler() {}
void serial_handler() {}
void can_handler() {}
void usb_handler() {}
}

int main() {
    const CoreClock clock =
        start_core_clock(rcc_registers, peripheral<PwrRegisters>(kPwrBase), peripheral<FlashRegisters>(kFlashBase));
    rcc_registers.AHB2ENR = rcc::AHB2ENR_GPIOAEN | rcc::AHB2ENR_GPIOBEN | rcc::AHB2ENR_GPIOCEN;
    rcc_registers.APB1ENR1 = rcc_registers.APB1ENR1 | rcc::APB1ENR1_TIM2EN | rcc::APB1ENR1_USART2EN;
    for (const auto line : {board_pins::kEnable1, board_pins::kEnable2, board_pins::kEnable3, board_pins::kHeartbeat, board_pins::kStatusLed}) {
        pin(line).make_output();
    }
    pin(board_pins::kSerialTx).make_alternate(board_pins::kSerialFunction);
    pin(board_pins::kSerialRx).make_alternate(board_pins::kSerialFunction, true);
    device_clock.start(hertz_of(clock));

    auto& usart = peripheral<UsartRegisters>(kUsart2Base);
    usart.BRR = hertz_of(clock) / 921'600;
    usart.CR1 = usart::CR1_UE | usart::CR1_TE | usart::CR1_RE | usart::CR1_FIFOEN;
    say("tricoil nucleo-g474re ");
    say(board_pins::image_header.commit.data());
    say(clock == CoreClock::crystal ? " crystal\n" : " internal\n");

    auto& tick = peripheral<SysTickRegisters>(kSysTickBase);
    tick.RVR = hertz_of(clock) / 1000 - 1;
    tick.CVR = 0;
    tick.CSR = systick::CSR_ENABLE | systick::CSR_TICKINT | systick::CSR_CLKSOURCE;
    pin(board_pins::kStatusLed).set(true);
    for (;;) {
        asm volatile("wfi");
    }
}
