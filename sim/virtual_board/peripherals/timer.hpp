// Timers as time bases with compare channels (RM0440 sections 28 to 30): count edge-aligned, interrupt, request DMA, trigger
// other peripherals. Their pins are not simulated.
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
};

class Timer final : public RegisterPeripheral {
public:
    Timer(Machine& machine, Dma& dma, TimerParams params);

    /// Called on each trigger output TRGO.
    std::vector<std::function<void()>> on_trigger;

    /// Ticks from one overflow to the next.
    [[nodiscard]] Ticks period() const { return (Ticks{reload_} + 1) * ticks_per_count(); }
    /// Call it after a change of the timer clock.
    void clock_changed();

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr unsigned kMaxChannels = 4;
    static std::vector<Register> list(const TimerParams& params);

    void overflow();
    void update(bool by_software);
    void trigger(std::uint32_t mode);
    void restart(std::uint32_t count);
    void write_reload(std::uint32_t value);
    void write_compare(unsigned channel, std::uint32_t value);
    void generate(std::uint32_t value);
    /// Sets the flags of the compare values that the counter has passed.
    void settle();
    void match(unsigned channel);
    void schedule_match();
    void show_interrupt();
    [[nodiscard]] bool is_running() const { return is_set(registers_[0x00], 0) && reload_ > 0; }
    [[nodiscard]] bool counts_down() const { return is_set(registers_[0x00], 4); }
    [[nodiscard]] Ticks ticks_per_count() const { return (Ticks{prescaler_} + 1) * clock_; }
    [[nodiscard]] std::uint32_t elapsed() const;
    [[nodiscard]] std::uint32_t count() const;
    [[nodiscard]] std::uint32_t point(unsigned channel) const;
    [[nodiscard]] bool is_preloaded(unsigned channel) const;

    Machine& machine_;
    Dma& dma_;
    TimerParams params_;
    std::uint32_t max_count_;
    Event overflow_;
    Event match_;
    Ticks clock_ = 1;
    std::uint32_t stopped_at_ = 0;
    std::uint32_t prescaler_ = 0;  // active values: registers at the last update
    std::uint32_t reload_ = 0;
    std::uint32_t repetitions_ = 0;
    std::array<std::uint32_t, kMaxChannels> compare_{};
    std::array<bool, kMaxChannels> matched_{};  // in this period
};

}  // namespace tricoil::virtual_board
