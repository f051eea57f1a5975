// The interrupt controller: which exception is pending, which runs, and which may interrupt it (ARMv7-M B1.5, B3.4).
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
constexpr int kSvCall = 11;
constexpr int kPendSv = 14;
constexpr int kSysTick = 15;

/// What the processor's own registers say about masking.
struct Masks {
    bool primask = false;
    bool faultmask = false;
    std::uint8_t basepri = 0;
};

/// From pending to its first instruction, whatever was in the way.
struct Latency {
    Ticks worst = 0;
    std::uint64_t entries = 0;
};

/// Sits behind 0xE000E100-0xE000E4EF; system exceptions' priorities come from the system control block.
class Nvic final : public Peripheral {
public:
    explicit Nvic(const Events& events) : events_(events) {}

    /// A peripheral's interrupt output: pends when it rises, and again if it still is high when its handler returns.
    void set_level(int interrupt, bool high);
    /// Pends an exception by number.
    void pend(int exception);
    void unpend(int exception);

    /// Something is more urgent than what runs, whatever the masks say: worth asking to_take().
    [[nodiscard]] bool may_take() const { return pending_count_ > 0 && most_urgent() != 0; }
    /// The exception that would be entered now; 0: none.
    [[nodiscard]] int to_take(const Masks& masks) const;
    /// Whether WFI ends: as to_take, but PRIMASK does not count (ARMv7-M B1.5.19).
    [[nodiscard]] bool wakes(Masks masks) const;

    void enter(int exception);
    void leave(int exception);
    [[nodiscard]] bool is_pending(int exception) const { return state(exception).pending; }
    [[nodiscard]] int active_count() const { return active_count_; }
    /// Lowest number of those pending and enabled, whatever their priority; for ICSR.
    [[nodiscard]] int first_pending() const;

    [[nodiscard]] std::uint8_t priority(int exception) const { return state(exception).priority; }
    void set_priority(int exception, std::uint8_t value) {
        state(exception).priority = value & 0xF0U;  // 4 bits are there
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
        bool level = false;
        std::uint8_t priority = 0;
        Ticks since = 0;  // when it became pending
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
    mutable int urgent_ = kUnknown;  // most_urgent(), until something changes
};

}  // namespace tricoil::virtual_board
