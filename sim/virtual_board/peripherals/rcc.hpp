// Reset and clock control (RM0440 section 7): clock sources, clock enables, reset causes.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

/// Flags of RCC_CSR.
enum class ResetCause : std::uint8_t { pin = 26, power = 27, software = 28, watchdog = 29 };

class Rcc final : public Peripheral {
public:
    explicit Rcc(Machine& machine);

    /// The crystal of the board stops, and does not start again.
    void break_crystal();
    void set_reset_cause(ResetCause cause);
    /// For Mapping::clock_is_on: one bit of an enable register.
    [[nodiscard]] std::function<bool()> clock(std::uint32_t enable_register, unsigned bit) const;

    /// Clock of the processor, the memories and the peripherals, which have no further dividers. Hz.
    [[nodiscard]] double core_hz() const;
    [[nodiscard]] bool has_48_mhz() const;
    [[nodiscard]] std::uint32_t kernel_clocks() const { return registers_[kCcipr]; }

    /// Throws RunFailure if flash wait states or core voltage do not allow this frequency; set by the board.
    std::function<void(double hz)> check_frequency;

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

    static constexpr std::uint32_t kAhb1 = 0x48;
    static constexpr std::uint32_t kAhb2 = 0x4C;
    static constexpr std::uint32_t kApb1 = 0x58;
    static constexpr std::uint32_t kApb2 = 0x60;

private:
    void start_hsi48(bool on);
    static constexpr std::uint32_t kCcipr = 0x88;
    [[nodiscard]] double pll_input_hz() const;
    [[nodiscard]] double system_hz() const;
    void control(std::uint32_t value);
    void start_oscillator(unsigned enable_bit, Event& ready, double after_s);
    void choose(std::uint32_t value);
    void apply();

    Machine& machine_;
    RegisterFile<40> registers_;
    Event crystal_ready_;
    Event pll_ready_;
    Event hsi48_ready_;
    bool crystal_works_ = true;
    bool security_interrupt_ = false;
    std::uint32_t causes_ = 1U << 26U | 1U << 27U;
};

}  // namespace tricoil::virtual_board
