// A processor with memory, bus and interrupt controller, without manufacturer-specific peripherals.
#pragma once

#include <cstdint>
#include <span>

#include "sim/virtual_board/machine/bit_band.hpp"
#include "sim/virtual_board/machine/cpu.hpp"

namespace tricoil::virtual_board {

class Machine {
public:
    Machine();

    /// Loads the image, byte for byte, at the start of flash. Throws std::invalid_argument: wrong size, or no vector table.
    void load(std::span<const std::uint8_t> image);

    /// Resets the processor and all peripherals, as after power-on or a system reset; RAM keeps its content.
    void reset();

    /// Runs until `time`, across resets. Returns at once after the firmware has entered the bootloader. Throws RunFailure.
    void run_until(Ticks time);

    /// Frequency of the processor and SysTick, from the next instruction on.
    void set_core_clock(Ticks ticks_per_cycle);

    /// Called on a reset requested by the firmware or a watchdog.
    std::function<void()> on_reset_request = [] {};
    /// Requests a reset before the next instruction.
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
    TraceMacrocell trace_;
    BitBand ram_bits_;
    BitBand peripheral_bits_;
    bool reset_requested_ = false;
};

}  // namespace tricoil::virtual_board
