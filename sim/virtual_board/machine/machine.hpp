// A processor with memory, bus and interrupts, without anything of a maker's around it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sim/virtual_board/machine/cpu.hpp"

namespace tricoil::virtual_board {

class Machine {
public:
    Machine();

    /// The image, byte for byte, from the start of flash. Throws std::invalid_argument: empty, longer than bank 1, no vector
    /// table.
    void load(std::span<const std::uint8_t> image);

    /// Processor and every peripheral as after power-on or a system reset; RAM keeps what it holds.
    void reset();

    /// Runs on, through resets that the firmware asks for by AIRCR. Throws RunFailure.
    void run_until(Ticks time);

    /// What else happens on a reset that the firmware, or a watchdog, asks for.
    std::function<void()> on_reset_request;
    /// Asks for a reset before the next instruction.
    void request_reset();

    [[nodiscard]] Ticks now() const { return events.now(); }

    Events events;
    Memory memory;
    Bus bus;
    Nvic nvic;
    SystemControl control;
    Cpu cpu;

private:
    SysTick sys_tick_;
    CycleCounter cycle_counter_;
    bool reset_requested_ = false;
};

}  // namespace tricoil::virtual_board
