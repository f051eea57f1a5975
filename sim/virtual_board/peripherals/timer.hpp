// Timers (RM0440 sections 28 to 30): count, compare, interrupt, request DMA, trigger other peripherals and each other. Their pins
// are not simulated: outputs drive nothing, inputs keep their inactive level.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

struct TimerParams {
    unsigned bits = 16;
    unsigned channels = 0;  // compare channels, up to 4
    bool advanced = false;  // repetition counter, break and dead time
    InterruptLine update;
    std::optional<InterruptLine> compare;     // if it is not the line of the update
    std::optional<unsigned> update_request;   // number at the DMA request multiplexer
    std::optional<unsigned> compare_request;  // of channel 1; those of the others follow
    std::function<Ticks()> clock;             // ticks per cycle of the timer clock
    std::function<Ticks(unsigned)> input{};   // ticks per cycle of the clock that TISEL.TI1SEL selects, 0: none; empty: no choice
};

class Timer final : public RegisterPeripheral {
public:
    Timer(Machine& machine, Dma& dma, TimerParams params);

    /// Called on each trigger output TRGO.
    std::vector<std::function<void()>> on_trigger;

    /// TRGO of `master` is the internal trigger `input`, by its number in SMCR.TS.
    void connect(unsigned input, Timer& master);
    /// Call it after a change of the timer clock.
    void clock_changed();

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr unsigned kMaxChannels = 6;  // 5 and 6 only compare, without interrupt
    static constexpr Ticks kNever = Ticks{1} << 32U;
    static unsigned channel_count(const TimerParams& params);
    static std::vector<Register> list(const TimerParams& params);

    void overflow();
    void update(bool by_software);
    void load();
    void begin_period();
    [[nodiscard]] std::uint32_t register_of(unsigned n) const;
    void trigger(std::uint32_t mode);
    void triggered(unsigned input);
    void request(unsigned id, std::uint32_t source);
    std::uint32_t next_of_burst();
    void capture(unsigned channel);
    void schedule_capture();
    void control(std::uint32_t value);
    void restart(std::uint32_t count);
    void write_reload(std::uint32_t value);
    void write_compare(unsigned channel, std::uint32_t value);
    void generate(std::uint32_t value);
    /// Sets the flags of the compare values that the counter has passed.
    void settle();
    void match(unsigned channel);
    void schedule_match();
    void show_interrupt();
    [[nodiscard]] bool is_enabled() const { return is_set(registers_[0x00], 0) && reload_ > 0; }
    [[nodiscard]] bool is_running() const { return is_enabled() && !waits_for_triggers(); }
    [[nodiscard]] bool waits_for_triggers() const;
    [[nodiscard]] bool counts_down() const { return is_set(registers_[0x00], 4); }
    [[nodiscard]] bool is_centred() const { return field(registers_[0x00], 5, 2) != 0; }
    [[nodiscard]] bool dithers() const { return is_set(registers_[0x00], 12); }
    [[nodiscard]] Ticks ticks_per_count() const { return (Ticks{prescaler_} + 1) * clock_; }
    /// Last count since an overflow.
    [[nodiscard]] std::uint32_t last() const { return is_centred() ? reload_ - 1 : reload_; }
    [[nodiscard]] Ticks period() const { return (Ticks{last()} + 1) * ticks_per_count(); }
    [[nodiscard]] std::uint32_t elapsed() const;
    [[nodiscard]] std::uint32_t count() const;
    [[nodiscard]] Ticks point(unsigned channel) const;
    [[nodiscard]] bool is_input(unsigned channel) const;
    [[nodiscard]] bool is_preloaded(unsigned channel) const;
    [[nodiscard]] std::uint32_t whole(std::uint32_t value) const;
    [[nodiscard]] std::uint32_t locked(std::uint32_t offset) const;

    Machine& machine_;
    Dma& dma_;
    TimerParams params_;
    std::uint32_t max_count_;
    unsigned channels_;
    Event overflow_;
    Event match_;
    Event capture_;
    std::array<Timer*, 16> masters_{};
    Ticks clock_ = 1;
    std::uint32_t stopped_at_ = 0;
    std::uint32_t prescaler_ = 0;                           // active values: registers at the last update
    std::array<std::uint32_t, kMaxChannels + 1> active_{};  // compare values, then the period
    std::uint32_t reload_ = 0;                              // in this period
    std::array<std::uint32_t, kMaxChannels> compare_{};
    std::array<bool, kMaxChannels> matched_{};
    std::uint32_t repetitions_ = 0;
    std::uint32_t divided_ = 0;   // triggers since the last count
    std::uint32_t phase_ = 0;     // of the 16 periods of a dithering pattern
    std::uint32_t burst_at_ = 0;  // register of a DMA burst
    bool lock_is_set_ = false;    // BDTR has been written
    bool is_triggered_ = false;   // by another timer, at this moment
};

}  // namespace tricoil::virtual_board
