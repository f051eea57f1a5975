// Interrupt controller: pending, active and preempting exceptions (ARMv7-M B1.5, B3.4).
#pragma once

#include <array>
#include <cstdint>

#include "sim/virtual_board/machine/events.hpp"
#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

constexpr int kFirstInterrupt = 16;  // exception number of interrupt 0
constexpr int kInterrupts = 102;     // of the STM32G4
constexpr int kExceptions = kFirstInterrupt + kInterrupts;

constexpr int kNmi = 2;
constexpr int kHardFault = 3;
constexpr int kMemManage = 4;  // BusFault and UsageFault follow
constexpr int kSvCall = 11;
constexpr int kPendSv = 14;
constexpr int kSysTick = 15;

/// Line at the interrupt controller. Peripherals that share a line have different sources; the line is high while one of them is.
struct InterruptLine {
    InterruptLine(int line, unsigned from = 0) : number(line), source(from) {}  // NOLINT: most lines have one source
    int number;
    unsigned source;
};

/// Mask registers of the processor.
struct Masks {
    bool primask = false;
    bool faultmask = false;
    std::uint8_t basepri = 0;
};

/// Longest time from pending to the first instruction of the handler, over all causes of delay.
struct Latency {
    Ticks worst = 0;
    std::uint64_t entries = 0;
};

/// Registers 0xE000E100-0xE000E4EF; the system control block sets the priorities of system exceptions.
class Nvic final : public Peripheral {
public:
    explicit Nvic(const Events& events) : events_(events) {}

    /// Interrupt output of a peripheral: a rising edge makes the interrupt pending; if the output is still high when the handler
    /// returns, the interrupt becomes pending again.
    void set_level(InterruptLine line, bool high);
    /// Makes an exception pending.
    void pend(int exception);
    void unpend(int exception);

    /// True if an exception is more urgent than the running one, without regard to the masks. If false, to_take() returns 0.
    [[nodiscard]] bool may_take() const { return pending_count_ > 0 && most_urgent() != 0; }
    /// True if an exception is pending, enabled or not.
    [[nodiscard]] bool has_pending() const { return pending_count_ > 0; }
    /// The exception to enter now; 0: none.
    [[nodiscard]] int to_take(const Masks& masks) const;
    /// True if WFI ends: like to_take(), but ignores PRIMASK (ARMv7-M B1.5.19).
    [[nodiscard]] bool wakes(Masks masks) const;

    void enter(int exception);
    void leave(int exception);
    [[nodiscard]] bool is_pending(int exception) const { return state(exception).pending; }
    [[nodiscard]] bool is_active(int exception) const { return state(exception).active; }
    [[nodiscard]] int active_count() const { return active_count_; }
    /// Lowest number of the pending and enabled exceptions, without regard to priority; for ICSR.
    [[nodiscard]] int first_pending() const;

    [[nodiscard]] std::uint8_t priority(int exception) const { return state(exception).priority; }
    void set_priority(int exception, std::uint8_t value) {
        state(exception).priority = value & 0xF0U;  // 4 bits are implemented
        changed();
    }
    void set_group(unsigned prigroup) {
        group_ = prigroup & 7U;
        changed();
    }
    [[nodiscard]] unsigned group() const { return group_; }

    [[nodiscard]] const std::array<Latency, kExceptions>& latencies() const { return latencies_; }

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    struct State {
        bool enabled = false;
        bool pending = false;
        bool active = false;
        std::uint32_t levels = 0;  // of the sources
        std::uint8_t priority = 0;
        Ticks since = 0;  // time at which it became pending
    };

    [[nodiscard]] const State& state(int exception) const { return states_[static_cast<std::size_t>(exception)]; }
    State& state(int exception) { return states_[static_cast<std::size_t>(exception)]; }
    [[nodiscard]] int group_priority(int exception) const;
    [[nodiscard]] int most_urgent() const;
    void changed() { urgent_ = kUnknown; }
    template <typename Act>
    void for_bits(std::uint32_t word, std::uint32_t value, Act act);

    const Events& events_;
    std::array<State, kExceptions> states_{};
    std::array<Latency, kExceptions> latencies_{};
    unsigned group_ = 0;
    int pending_count_ = 0;
    int active_count_ = 0;
    static constexpr int kUnknown = -1;
    mutable int urgent_ = kUnknown;  // cached most_urgent()
};

}  // namespace tricoil::virtual_board
