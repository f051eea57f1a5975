// The STM32G474RE on its Nucleo board, with coils and links: the hardware that runs the flash image.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/virtual_board/coils/board_circuit.hpp"
#include "sim/virtual_board/coils/coil_bench.hpp"
#include "sim/virtual_board/coils/low_pass.hpp"
#include "sim/virtual_board/general_peripherals.hpp"
#include "sim/virtual_board/injected_code.hpp"
#include "sim/virtual_board/links/can_wire.hpp"
#include "sim/virtual_board/links/serial_line.hpp"
#include "sim/virtual_board/links/usb_wire.hpp"
#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/adc.hpp"
#include "sim/virtual_board/peripherals/dac.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"
#include "sim/virtual_board/peripherals/exti.hpp"
#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/flash.hpp"
#include "sim/virtual_board/peripherals/gpio.hpp"
#include "sim/virtual_board/peripherals/iwdg.hpp"
#include "sim/virtual_board/peripherals/opamp.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/stored_registers.hpp"
#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {

/// Results of the tracker's four converters at one time, as read from DR, and the coil drive at that time.
struct SampleRecord {
    Ticks time = 0;
    std::array<std::uint16_t, kChannels> codes{};  // sensor coils 1-3, reference
    std::uint8_t gain = 0;                         // of the op-amps
    std::uint8_t driven = 0;                       // enable lines that are high, one bit per source coil
};

class VirtualBoard {
public:
    /// `scenario` must outlive the board. Throws std::invalid_argument for an invalid image.
    VirtualBoard(std::span<const std::uint8_t> image, const sim::Scenario& scenario,
                 const BoardCircuit& circuit = BoardCircuit::draw(0));

    /// Power off and on again: RAM is lost, flash is kept.
    void power_cycle();
    /// Loses power, and restores it, in the middle of the n-th flash erase or program operation from now on; 0 is the next one.
    void lose_power_in_flash_operation(std::uint64_t n);
    /// Throws RunFailure; its message begins with the pc.
    void run_until(double time_s) { machine.run_until(ticks(time_s)); }
    [[nodiscard]] double now_s() const { return seconds(machine.now()); }

    /// Presses or releases the user button B1 (PC13), which is high while it is pressed.
    void press_button(bool pressed) { gpio('C').set_outside(kButtonPin, pressed ? Gpio::Outside::high : Gpio::Outside::low); }
    /// Number of level changes of the LED LD2 (PA5).
    [[nodiscard]] unsigned led_changes() const { return led_changes_; }

    /// True if bank 2 is at the start of the flash.
    [[nodiscard]] bool runs_bank_2() const { return flash.is_exchanged(); }
    /// Number of resets since power-on, without the power-on reset.
    [[nodiscard]] unsigned resets() const { return resets_; }

    /// Temperature of the chip, and supply as its voltage reference shows it; the analog circuits keep their voltages.
    double chip_celsius = 30;
    double heat_sink_celsius = 30;
    /// A power stage is in thermal shutdown: the hardware switches all stages off and pulls PC1 low.
    void set_stage_hot(bool hot) {
        stage_hot_ = hot;
        gpio('C').set_outside(kStagesCoolPin, hot ? Gpio::Outside::low : Gpio::Outside::high);
    }
    double shown_supply_v = CoilBench::kSupplyV;

    /// Called with each set of converter results; may be empty.
    std::function<void(const SampleRecord&)> on_sample;
    /// The program continues in this code. A fault that it causes is an exception, as on the chip.
    void inject(InjectedCode code, bool masks_interrupts = false);

    Gpio& gpio(char port) { return *gpio_[static_cast<std::size_t>(port - 'A')]; }
    [[nodiscard]] const Gpio& gpio(char port) const { return *gpio_[static_cast<std::size_t>(port - 'A')]; }
    /// Converter 1, 3, 4 or 5.
    Adc& adc(unsigned number);

    Machine machine;
    Rcc rcc;
    Pwr pwr;
    Flash flash;
    Dma dma;
    Exti exti;
    GeneralPeripherals general;
    Usb usb;
    std::array<std::unique_ptr<Fdcan>, 3> fdcans;  // FDCAN1 to FDCAN3
    BoardCircuit circuit;                          // its amplifiers have a state
    CoilBench bench;
    SerialLine serial;
    CanWire can;
    UsbWire usb_wire;

private:
    static constexpr unsigned kStagesCoolPin = 1;   // all of port C
    static constexpr unsigned kFirstEnablePin = 6;  // to 8
    static constexpr unsigned kButtonPin = 13;

    void attach();
    void attach_analog();
    void attach_pins();
    void attach_can();
    void attach_data_pages();
    void wire_pins();
    void wire_analog();
    void wire_low_power();
    void add(const std::string& name, std::uint32_t base, std::uint32_t size, Peripheral& device,
             std::uint32_t enable_register = 0, unsigned bit = 0);
    void reset_peripheral(std::uint32_t enable_register, unsigned bit);
    void check_frequency(double hz) const;
    void check_can_pins(unsigned number) const;
    void pin_changed(char port);
    void sleep_deeply();
    void wake_from_standby();
    void trigger(unsigned timer);
    void drive();
    void update_outputs();
    void record(std::size_t channel, std::uint32_t result);
    [[nodiscard]] double internal_dac_v(unsigned channel) const;
    [[nodiscard]] std::optional<double> internal_input_v(unsigned converter, unsigned channel) const;
    [[nodiscard]] double sensor_input_v(unsigned channel, double step_s, double& noise);
    [[nodiscard]] std::uint32_t code_of(unsigned channel);
    [[nodiscard]] std::uint32_t free_converter_code();
    [[nodiscard]] bool is_enabled(unsigned coil) const { return !stage_hot_ && gpio('C').drives_high(kFirstEnablePin + coil); }
    [[nodiscard]] double thermistor_share() const;
    [[nodiscard]] double filtered(unsigned channel, double step_s);
    void restart(ResetCause cause);

    std::array<std::unique_ptr<Gpio>, 7> gpio_;
    Dac dac_1_;
    Dac dac_2_;
    Dac dac_3_;
    Dac dac_4_;
    AdcCommon common_12_;
    AdcCommon common_345_;
    std::array<std::unique_ptr<Adc>, kChannels> adcs_;  // by channel: sensor coils 1-3, reference
    Adc adc_2_;                                         // the tracker does not use it
    Opamp opamp_;
    Iwdg watchdog_;
    StoredRegisters clock_recovery_;
    StoredRegisters system_configuration_;
    StoredRegisters debug_unit_;
    std::vector<std::pair<std::pair<std::uint32_t, unsigned>, Peripheral*>> resettable_;  // by enable register and bit
    std::mt19937_64 random_;
    std::mt19937_64
        inside_random_;  // noise of the internal inputs; the noise of the coils does not depend on how often they are read
    std::normal_distribution<double> normal_{0, 1};
    std::normal_distribution<double> inside_normal_{0, 1};
    SampleRecord sample_;
    std::array<Ticks, kChannels> last_conversion_{};
    std::array<LowPass, kChannels> low_pass_;  // for voltages
    std::array<LowPass, kSensorCoils> flux_low_pass_;
    bool heartbeat_ = false;
    bool led_ = false;
    bool standby_ = false;
    bool stage_hot_ = false;
    unsigned led_changes_ = 0;
    std::optional<ResetCause> cause_;  // of the next reset request; empty: software
    unsigned resets_ = 0;
};

}  // namespace tricoil::virtual_board
