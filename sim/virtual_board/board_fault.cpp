#include "sim/virtual_board/board_fault.hpp"

#include <array>

namespace tricoil::virtual_board {
namespace {

using Board = VirtualBoard;

constexpr double kNoTime = std::numeric_limits<double>::infinity();

constexpr std::array<BoardFaultKind, 20> kKinds{{
    {"adc_silent", "adc_silent:N  converter N (1, 3, 4 or 5) never ends a conversion",
     [](Board& b, unsigned n) { b.adc(n).set_stuck(true); }, [](Board& b, unsigned n) { b.adc(n).set_stuck(false); }},
    {"dma_stuck", "dma_stuck  the DMA serves no request: converters overrun, carriers stop",
     [](Board& b, unsigned) { b.dma.set_stuck(true); }, [](Board& b, unsigned) { b.dma.set_stuck(false); }},
    {"crystal", "crystal  the crystal stops, or does not start", [](Board& b, unsigned) { b.rcc.break_crystal(); }},
    {"hang", "hang  the main program stops, interrupts continue", [](Board& b, unsigned) { b.inject(InjectedCode::idle); }},
    {"hang_masked", "hang_masked  the main program and all interrupts stop",
     [](Board& b, unsigned) { b.inject(InjectedCode::idle, true); }},
    {"bad_access", "bad_access  the program reads an address without memory: a processor fault",
     [](Board& b, unsigned) { b.inject(InjectedCode::bad_access); }},
    {"stack_overflow", "stack_overflow  the program pushes registers until its stack is full",
     [](Board& b, unsigned) { b.inject(InjectedCode::stack_overflow); }},
    {"code_in_ram", "code_in_ram  the program jumps to RAM", [](Board& b, unsigned) { b.inject(InjectedCode::code_in_ram); }},
    {"power_loss", "power_loss  power off and on again", [](Board& b, unsigned) { b.power_cycle(); }},
    {"flash_power_loss", "flash_power_loss:N  power is lost within the N-th flash erase or program operation from then on",
     [](Board& b, unsigned n) { b.lose_power_in_flash_operation(n); }},
    {"usb_resets", "usb_resets:N  USB bus reset every N milliseconds", [](Board& b, unsigned) { b.usb_wire.reset_only(); },
     nullptr, true},
    {"can_babble", "can_babble  another node sends identifier 0 without pause",
     [](Board& b, unsigned) {
         b.can.babble_with(CanFrame{0, false, true, true, std::vector<std::uint8_t>(64, 0x55)});
     },
     [](Board& b, unsigned) { b.can.babble_with(std::nullopt); }},
    {"can_errors", "can_errors:N  the next N frames of the board are destroyed",
     [](Board& b, unsigned n) { b.can.frames_to_destroy = n; }},
    {"button", "button  the user button B1 is pressed", [](Board& b, unsigned) { b.press_button(true); },
     [](Board& b, unsigned) { b.press_button(false); }},
    {"option_bytes", "option_bytes:N  the option bytes are N (FLASH_OPTR), for example 0xFFEFF8AA of the factory",
     [](Board& b, unsigned n) { b.flash.set_options(n); }},
    {"chip_temperature", "chip_temperature:N  the chip has N degrees Celsius", [](Board& b, unsigned n) { b.chip_celsius = n; }},
    {"heat_sink", "heat_sink:N  the heat sink of the power stages has N degrees Celsius",
     [](Board& b, unsigned n) { b.heat_sink_celsius = n; }},
    {"hot_stage", "hot_stage  a power stage is in thermal shutdown", [](Board& b, unsigned) { b.set_stage_hot(true); },
     [](Board& b, unsigned) { b.set_stage_hot(false); }},
    {"supply", "supply:N  the chip's voltage reference shows a supply of N millivolts",
     [](Board& b, unsigned n) { b.shown_supply_v = 1e-3 * n; }},
    {"can_alone", "can_alone  no other node on the CAN bus acknowledges",
     [](Board& b, unsigned) { b.can.has_other_nodes = false; }, [](Board& b, unsigned) { b.can.has_other_nodes = true; }},
}};

}  // namespace

std::span<const BoardFaultKind> board_fault_kinds() { return kKinds; }

void BoardFaults::update() {
    const double now = board_.now_s();
    for (BoardFault& fault : faults_) {
        if (now >= fault.begin_s) {
            fault.begin_s = fault.kind->repeats ? now + 1e-3 * fault.number : kNoTime;
            fault.kind->begin(board_, fault.number);
        }
        if (now >= fault.end_s) {
            fault.begin_s = fault.end_s = kNoTime;
            if (fault.kind->end != nullptr) {
                fault.kind->end(board_, fault.number);
            }
        }
    }
}

}  // namespace tricoil::virtual_board
