// A processor with memory, bus and interrupt controller, without manufacturer-specific peripherals.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "sim/virtual_board/machine/cpu.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Bit-band alias of RAM or peripherals (ARMv7-M B3.1): one word for each bit.
class BitBand final : public Peripheral {
public:
    /// Access to the 4 bytes at an offset from the region's begin.
    BitBand(std::function<std::uint32_t(std::uint32_t)> load, std::function<void(std::uint32_t, std::uint32_t)> store)
        : load_(std::move(load)), store_(std::move(store)) {}

    std::uint32_t read(std::uint32_t offset) override { return flag(is_set(load_(word(offset)), bit(offset)), 0); }
    void write(std::uint32_t offset, std::uint32_t value) override {
        const std::uint32_t others = load_(word(offset)) & ~(1U << bit(offset));
        store_(word(offset), others | (value & 1U) << bit(offset));
    }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned) override { write(offset & ~3U, value); }
    void reset() override {}

private:
    static std::uint32_t word(std::uint32_t offset) { return offset / 128 * 4; }
    static unsigned bit(std::uint32_t offset) { return offset / 4 % 32; }

    std::function<std::uint32_t(std::uint32_t)> load_;
    std::function<void(std::uint32_t, std::uint32_t)> store_;
};

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
