// Reset and clock control (RM0440 section 7): clock sources, bus clocks, kernel clocks, clock enables, resets and their causes.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Flags of RCC_CSR.
enum class ResetCause : std::uint8_t { pin = 26, power = 27, software = 28, watchdog = 29 };
/// Buses of the slower peripherals, with dividers.
enum class Apb : std::uint8_t { one, two };

class Rcc final : public RegisterPeripheral {
public:
    explicit Rcc(Machine& machine);

    /// The crystal of the board stops, and does not start again.
    void break_crystal();
    void set_reset_cause(ResetCause cause);
    /// For Mapping::clock_is_on: one bit of an enable register.
    [[nodiscard]] std::function<bool()> clock(std::uint32_t enable_register, unsigned bit) const;

    /// Clock of the processor, the memories and the AHB peripherals. Hz.
    [[nodiscard]] double core_hz() const;
    [[nodiscard]] double apb_hz(Apb bus) const;
    /// Timers count at twice the frequency of a divided bus.
    [[nodiscard]] Ticks timer_ticks(Apb bus) const;
    /// Ticks per cycle of the clock that the field of CCIPR at `position` selects for a serial port; 0: off.
    [[nodiscard]] Ticks serial_ticks(unsigned position, Apb bus) const;
    /// Clock at input 1 of TIM16 and TIM17, by TISEL.TI1SEL: 0 if it is still, negative if it is not in this model.
    [[nodiscard]] Ticks capture_ticks(unsigned input) const;
    [[nodiscard]] double fdcan_hz() const;
    /// Asynchronous clock of the converters that the field of CCIPR at `position` selects; 0: none.
    [[nodiscard]] double adc_hz(unsigned position) const;
    /// Clock of USB and RNG; 0: off. Hz.
    [[nodiscard]] double usb_hz() const;
    [[nodiscard]] bool has_48_mhz() const { return usb_hz() == 48e6; }

    /// Throws RunFailure if flash wait states or core voltage do not allow this frequency; set by the board.
    std::function<void(double hz)> check_frequency = [](double) {};
    /// Throws RunFailure if BDCR is write-protected (PWR_CR1.DBP); set by the board.
    std::function<void()> check_backup = [] {};
    /// Called after a change of clocks.
    std::vector<std::function<void()>> on_change;
    /// Called when software resets the peripheral of this enable bit.
    std::function<void(std::uint32_t enable_register, unsigned bit)> on_peripheral_reset = [](auto...) {};

    /// Stop mode ends with HSI as the system clock, the other fast clocks off.
    void leave_stop();

    std::uint32_t read(std::uint32_t offset) override;
    void reset() override;

    static constexpr std::uint32_t kAhb1 = 0x48;
    static constexpr std::uint32_t kAhb2 = 0x4C;
    static constexpr std::uint32_t kApb1 = 0x58;
    static constexpr std::uint32_t kApb1More = 0x5C;
    static constexpr std::uint32_t kApb2 = 0x60;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr std::uint32_t kCfgr = 0x08;
    static constexpr std::uint32_t kCcipr = 0x88;
    static constexpr std::uint32_t kCsr = 0x94;

    enum class PllOutput : std::uint8_t { p, q, r };
    [[nodiscard]] double crystal_hz() const;
    [[nodiscard]] double selected(unsigned position, const std::array<double, 4>& sources) const;
    [[nodiscard]] double pll_input_hz() const;
    [[nodiscard]] double pll_hz(PllOutput output) const;
    [[nodiscard]] double system_hz() const;
    void control(std::uint32_t value);
    void become_ready(std::uint32_t control_register, unsigned ready_bit, unsigned interrupt);
    void show_interrupt();
    void start_oscillator(std::uint32_t control_register, unsigned enable_bit, Event& ready, double after_s);
    void check_pll() const;
    void write_pll(std::uint32_t value);
    void write_backup(std::uint32_t value);
    void reset_peripherals(std::uint32_t offset, std::uint32_t value);
    void choose(std::uint32_t value);
    void apply();

    Machine& machine_;
    Event crystal_ready_;
    Event pll_ready_;
    Event hsi48_ready_;
    Event slow_ready_;
    Event watch_crystal_ready_;
    bool crystal_works_ = true;
    bool security_interrupt_ = false;
    std::uint32_t ready_interrupts_ = 0;  // CIFR
    std::uint32_t causes_ = 1U << 26U | 1U << 27U;
};

}  // namespace tricoil::virtual_board
