#include "sim/virtual_board/board_fault.hpp"

#include <utility>

namespace tricoil::virtual_board {

BoardFaults::BoardFaults(VirtualBoard& board, std::vector<BoardFault> faults) : board_(board) {
    for (BoardFault& fault : faults) {
        planned_.push_back({std::move(fault)});
    }
}

void BoardFaults::update() {
    const double now = board_.now_s();
    for (Planned& p : planned_) {
        if (!p.begun && now >= p.fault.begin_s) {
            p.begun = true;
            begin(p);
        }
        if (p.begun && !p.ended && now >= p.fault.end_s) {
            p.ended = true;
            end(p.fault);
        }
        if (p.begun && !p.ended && now >= p.next_s) {
            repeat(p);
        }
    }
}

void BoardFaults::begin(Planned& planned) {
    const BoardFault& fault = planned.fault;
    if (fault.name == "adc_silent") {
        board_.adc(fault.number).set_stuck(true);
    } else if (fault.name == "dma_stuck") {
        board_.dma.set_stuck(true);
    } else if (fault.name == "crystal") {
        board_.rcc.break_crystal();
    } else if (fault.name == "hang" || fault.name == "hang_masked") {
        board_.inject(InjectedCode::idle, fault.name == "hang_masked");
    } else if (fault.name == "bad_access") {
        board_.inject(InjectedCode::bad_access);
    } else if (fault.name == "stack_overflow") {
        board_.inject(InjectedCode::stack_overflow);
    } else if (fault.name == "code_in_ram") {
        board_.inject(InjectedCode::code_in_ram);
    } else if (fault.name == "power_loss") {
        board_.power_cycle();
    } else if (fault.name == "flash_power_loss") {
        board_.lose_power_in_flash_operation(fault.number);
    } else if (fault.name == "can_babble") {
        board_.can.babble_with(CanFrame{0, false, true, true, std::vector<std::uint8_t>(64, 0x55)});
    } else if (fault.name == "can_errors") {
        board_.can.frames_to_destroy = fault.number;
    } else if (fault.name == "can_alone") {
        board_.can.has_other_nodes = false;
    } else if (fault.name == "button") {
        board_.press_button(true);
    } else if (fault.name == "chip_temperature") {
        board_.chip_celsius = fault.number;
    } else if (fault.name == "supply") {
        board_.shown_supply_v = 1e-3 * fault.number;
    } else if (fault.name == "option_bytes") {
        board_.flash.set_options(fault.number);
    }
}

void BoardFaults::repeat(Planned& planned) {
    if (planned.fault.name == "usb_resets") {
        board_.usb_wire.reset_only();
        planned.next_s = board_.now_s() + 1e-3 * planned.fault.number;
    }
}

void BoardFaults::end(const BoardFault& fault) {
    if (fault.name == "adc_silent") {
        board_.adc(fault.number).set_stuck(false);
    } else if (fault.name == "dma_stuck") {
        board_.dma.set_stuck(false);
    } else if (fault.name == "can_babble") {
        board_.can.babble_with(std::nullopt);
    } else if (fault.name == "can_alone") {
        board_.can.has_other_nodes = true;
    } else if (fault.name == "button") {
        board_.press_button(false);
    }
}

}  // namespace tricoil::virtual_board
