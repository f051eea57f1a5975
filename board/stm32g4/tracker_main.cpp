// Composition root of a tracker board, and its interrupt handlers.
#include <optional>

#include "board/app/tracker_device.hpp"
#include "board/cortex_m/program.hpp"
#include "board/stm32g4/image_header.hpp"
#include "board/stm32g4/interrupts.hpp"
#include "board/stm32g4/tracker_board.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "measuring.hpp"  // from the board's own folder, like pins.hpp
#include "pins.hpp"

namespace {

using namespace tricoil;
using namespace tricoil::stm32g4;

// Static, because the board has no heap. Constructed in main, because the rates of the links depend on the clock.
std::optional<stm32g4_board::TrackerBoard> board_;
std::optional<app::TrackerDevice> device;

bool take_crystal_failure() {
    auto& rcc = peripheral<RccRegisters>(kRccBase);
    if ((rcc.CIFR & rcc::CIFR_CSSF) == 0) {
        return false;
    }
    rcc.CICR = rcc::CICR_CSSC;
    return true;
}

/// Not inlined, so that its stack is free afterwards.
[[gnu::noinline]] void set_up() {
    board_.emplace(start_core_clock(peripheral<RccRegisters>(kRccBase), peripheral<PwrRegisters>(kPwrBase),
                                    peripheral<FlashRegisters>(kFlashBase)));
    board_->begin();
    device.emplace(board_->hardware(),
                   this_board::device_params(stm32g4_board::unique_number(), stm32g4_board::image_header.firmware));
}

}  // namespace

extern "C" {
/// A damaged word of the calibration is handled by its reader. After a crystal failure or a damaged program the processor
/// restarts.
void nmi_handler() {
    if (take_crystal_failure() || !board_ || !board_->storage.on_ecc_error()) {
        board::halt();
    }
}
/// Only wakes the processor. A handler of fewer than three instructions may corrupt the result of a division or square root that
/// it interrupts (ES0430 2.1.2, Arm erratum 776924).
void tick_handler() { asm volatile("dsb\n nop\n nop"); }
void over_current_handler() { board_->acquisition.on_over_current(); }
void block_end_handler() { board_->acquisition.on_block_end(); }
void serial_handler() { board_->serial.on_interrupt(); }
void can_handler() { board_->can.on_interrupt(); }
void usb_handler() { board_->usb.on_interrupt(); }
}

int main() {
    set_up();
    device->boot();
    for (;;) {
        device->step();
    }
}
