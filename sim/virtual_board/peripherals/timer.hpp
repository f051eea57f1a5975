// A timer as a time base (RM0440 sections 29 and 30): counts core clock cycles, overflows, triggers other peripherals.
#pragma once

#include <functional>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

class Timer final : public Peripheral {
public:
    /// `bits`: 16 or 32; `interrupt`: its line number.
    Timer(Machine& machine, unsigned bits, int interrupt);

    /// Called on each trigger output, if CR2 selects the update event as trigger output.
    std::vector<std::function<void()>> on_trigger;

    /// Ticks from one overflow to the next.
    [[nodiscard]] Ticks period() const;

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

private:
    void overflow();
    void update();
    void restart(std::uint32_t count);
    [[nodiscard]] bool is_running() const { return is_set(registers_[0x00], 0); }
    [[nodiscard]] Ticks ticks_per_count() const;
    [[nodiscard]] std::uint32_t count() const;
    void show_interrupt();

    Machine& machine_;
    std::uint32_t max_count_;
    int interrupt_;
    RegisterFile<12> registers_;
    Event overflow_;
    Ticks zero_ = 0;  // time at which the count was 0
    std::uint32_t stopped_at_ = 0;
    std::uint32_t prescaler_ = 0;  // active value: PSC at the last update
};

}  // namespace tricoil::virtual_board
