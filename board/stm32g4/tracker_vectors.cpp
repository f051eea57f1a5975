// Vectors of a tracker board, and its coil enables.
#include "board/stm32g4/interrupts.hpp"
#include "board/stm32g4/startup.hpp"
#include "drivers/stm32g4/registers/gpio.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "pins.hpp"

namespace tricoil::stm32g4_board {
namespace {

using namespace this_board;
using namespace tricoil::stm32g4;

consteval Vectors tracker_vectors() {
    Vectors vectors = fault_vectors();
    vectors.nmi() = nmi_handler;
    vectors.tick() = tick_handler;
    vectors.interrupts[kOverCurrent.number] = over_current_handler;
    vectors.interrupts[kBlockEnd.number] = block_end_handler;
    vectors.interrupts[kSerial.number] = serial_handler;
    vectors.interrupts[kCan.number] = can_handler;
    vectors.interrupts[kUsb.number] = usb_handler;
    return vectors;
}

}  // namespace

void switch_outputs_off() {
    static_assert(kEnable1.port == kEnable2.port && kEnable1.port == kEnable3.port);
    constexpr std::uint32_t kEnables = 1U << kEnable1.number | 1U << kEnable2.number | 1U << kEnable3.number;
    constexpr auto kPort = static_cast<std::uintptr_t>(kEnable1.port - 'A');
    peripheral<GpioRegisters>(kGpioABase + kPort * kGpioPortBytes).BRR = kEnables;
}

}  // namespace tricoil::stm32g4_board

[[gnu::section(".vectors"), gnu::used]] constinit const tricoil::stm32g4_board::Vectors kVectors =
    tricoil::stm32g4_board::tracker_vectors();
