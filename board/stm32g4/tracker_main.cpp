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

/// A store just before the exception return may start a wrong handler (ES0430 2.1.3, Arm erratum 838869).
template <typename Unit, typename Action>
void handle(Unit& unit, Action act) {
    (unit.*act)();
    asm volatile("dsb" ::: "memory");
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
/// A damaged word of the calibration or of the banks' log is handled by its reader. After a crystal failure or a damaged program
/// the processor restarts.
void nmi_handler() {
    if (take_crystal_failure() || !board_ || !(board_->storage.on_ecc_error() || board_->image.on_ecc_error())) {
        board::halt();
    }
    asm volatile("dsb" ::: "memory");
}
/// Only wakes the processor. A handler of fewer than three instructions may corrupt the result of a division or square root that
/// it interrupts (ES0430 2.1.2, Arm erratum 776924).
void tick_handler() { asm volatile("dsb\n nop\n nop"); }
void over_current_handler() { handle(board_->acquisition, &Acquisition::on_over_current); }
void block_end_handler() { handle(board_->acquisition, &Acquisition::on_block_end); }
void serial_handler() { handle(board_->serial, &UsartPort::on_interrupt); }
void can_handler() { handle(board_->can, &FdcanPort::on_interrupt); }
void usb_handler() { handle(board_->usb, &UsbPort::on_interrupt); }
}

int main() {
    set_up();
    device->boot();
    board_->can.set_bus(device->parameters());
    for (;;) {
        device->step();
    }
}
