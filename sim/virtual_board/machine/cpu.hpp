// Cortex-M4F: Unicorn runs the instructions; this class handles the exceptions (ARMv7-M B1.5).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "sim/virtual_board/machine/block_facts.hpp"
#include "sim/virtual_board/machine/bus.hpp"
#include "sim/virtual_board/machine/events.hpp"
#include "sim/virtual_board/machine/memory.hpp"
#include "sim/virtual_board/machine/nvic.hpp"
#include "sim/virtual_board/machine/system_control.hpp"

struct uc_struct;

namespace tricoil::virtual_board {

/// Time model: one instruction takes one cycle, exception entry 12, exception return 10, tail chaining 6. Wait states, pipeline
/// and the longer VDIV and VSQRT are not modelled.
class Cpu {
public:
    static constexpr int kEntryCycles = 12;
    static constexpr int kReturnCycles = 10;
    static constexpr int kTailChainCycles = 6;

    Cpu(Memory& memory, Bus& bus, Events& events, Nvic& nvic, SystemControl& control);
    ~Cpu();
    Cpu(const Cpu&) = delete;
    Cpu& operator=(const Cpu&) = delete;

    /// Starts from the vector table.
    void reset();

    /// Runs until `time` or stop_soon(). Throws RunFailure; its message begins with the pc in hexadecimal.
    void run_until(Ticks time);
    void stop_soon() { stop_requested_ = true; }
    /// Continues the interrupted program at `address`, optionally with interrupts masked; for faults. Must not be called by an
    /// event.
    void jump(std::uint32_t address, bool masked);

    /// The next access to an address without memory, jump to such an address, or undefined instruction becomes an exception, as
    /// on the chip. Without this call it ends the run.
    void take_next_fault() { takes_fault_ = true; }

    /// The data pages of the bank that runs become a part of the bus. Call it before the first instruction.
    void map_data_pages();
    /// This part of the flash has other code. May be called by an event.
    void forget_flash(std::uint32_t offset, std::uint32_t bytes);
    /// Called with a store of 4 bytes to the flash, at an offset. False: the flash refuses it.
    std::function<bool(std::uint32_t, std::uint32_t)> on_flash_write = [](std::uint32_t, std::uint32_t) { return false; };
    /// The next instruction waits. May be called by an access to the bus.
    void wait(Ticks time) { add_cycles(static_cast<int>(time / ticks_per_cycle_)); }

    /// An event for WFE.
    void signal_event() { event_ = true; }
    /// Standby and shutdown: only a reset starts the processor again.
    void halt() { halted_ = true; }
    /// Called when the processor enters and leaves deep sleep (SCR.SLEEPDEEP); may be empty.
    std::function<void()> on_deep_sleep;
    std::function<void()> on_deep_wake;

    /// Core frequency, from the next instruction on.
    void set_ticks_per_cycle(Ticks ticks) { ticks_per_cycle_ = ticks; }
    [[nodiscard]] Ticks ticks_per_cycle() const { return ticks_per_cycle_; }

    /// Cycles since construction, sleep included; resets and power failures do not clear the count.
    [[nodiscard]] const std::uint64_t& cycles() const { return cycles_; }
    /// Cycles of instructions, exception entries and exception returns.
    [[nodiscard]] std::uint64_t busy_cycles() const { return busy_cycles_; }
    /// True while code in the system memory runs.
    [[nodiscard]] bool in_bootloader() const { return in_bootloader_; }
    [[nodiscard]] std::uint32_t pc() const;

private:
    static constexpr std::uint32_t kThumb = 1U << 24U;  // EPSR.T

    /// Cause of a fault exception.
    struct Fault {
        enum class Kind : std::uint8_t { data, fetch, instruction };
        Kind kind;
        std::uint32_t address;
    };

    struct Hooks;  // callbacks of Unicorn
    friend struct Hooks;

    template <typename Act>
    void guarded(Act act);
    void on_block(std::uint32_t address, std::uint32_t bytes);
    void on_interrupt(std::uint32_t number);
    const BlockFacts& facts_at(std::uint32_t address, std::uint32_t bytes);
    void run();
    void add_hook(int type, void* callback);
    void add_traps();
    void forget_block(std::uint32_t address);
    void forget_blocks_of_flash();
    [[nodiscard]] bool lacks_traps() const { return !traps_ && (control_.traps_division() || control_.traps_unaligned()); }
    void check_division(std::uint32_t address, std::uint32_t bytes);
    bool open_ram();
    bool store_to_flash(std::uint32_t address, std::uint32_t value);
    void undo_flash_store();
    bool may_run_in_ram(std::uint32_t address, std::uint32_t bytes);
    void start_sleep(bool until_event);
    void sleep();
    [[nodiscard]] bool wakes() const;
    void add_cycles(int cycles);

    // Exceptions: cpu_exceptions.cpp.
    void take_exceptions();
    void take_fault();
    void push_frame(std::uint32_t frame, std::uint32_t xpsr);
    void enter(bool tail_chained, std::uint32_t exc_return);
    void stack_frame();
    void leave(std::uint32_t exc_return);
    void unstack_frame(std::uint32_t exc_return);
    void use_float(std::uint32_t address);
    void save_float(std::uint32_t address);
    void sync_float_context(bool active);
    void store(std::uint32_t address, std::uint32_t word);
    [[nodiscard]] std::uint32_t load(std::uint32_t address);

    [[nodiscard]] Masks masks() const;
    [[nodiscard]] std::uint32_t get(int reg) const;
    void set(int reg, std::uint32_t value);

    Memory& memory_;
    Bus& bus_;
    Events& events_;
    Nvic& nvic_;
    SystemControl& control_;
    uc_struct* uc_ = nullptr;

    Ticks ticks_per_cycle_ = ticks_of_cycle(16e6);
    std::uint64_t cycles_ = 0;
    std::uint64_t busy_cycles_ = 0;
    Ticks limit_ = 0;
    bool stop_requested_ = false;
    bool stopping_ = false;  // uc_emu_stop was called from a hook
    bool asleep_ = false;
    bool deeply_asleep_ = false;
    bool until_event_ = false;  // sleeps by WFE
    bool event_ = false;        // event register
    bool halted_ = false;
    bool in_bootloader_ = false;
    bool float_context_ = false;  // CONTROL.FPCA
    int running_ = 0;             // IPSR
    std::optional<std::uint32_t> exception_return_;
    std::optional<std::string> failure_;
    std::optional<Fault> fault_;  // the reason for failure_, if it is a fault exception on the chip
    bool takes_fault_ = false;
    std::uint32_t block_ = 0;              // address of the running block
    std::vector<BlockFacts> flash_facts_;  // by half-word
    BlockFacts other_facts_;
    bool flash_has_changed_ = false;
    std::optional<std::pair<std::uint32_t, std::uint32_t>> flash_store_;     // address, content before
    bool traps_ = false;                                                     // hooks of the traps of CCR
    std::unordered_map<std::uint32_t, std::vector<std::uint8_t>> ram_code_;  // translated, by address
    std::optional<std::uint32_t> overwritten_;                               // such code that has changed
};

}  // namespace tricoil::virtual_board
