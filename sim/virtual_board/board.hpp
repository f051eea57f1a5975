// The STM32G474RE on its Nucleo board, with coils and links: the hardware that runs the flash image.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim/virtual_board/coils/coil_bench.hpp"
#include "sim/virtual_board/coils/sensor_amplifier.hpp"
#include "sim/virtual_board/links/can_wire.hpp"
#include "sim/virtual_board/links/serial_line.hpp"
#include "sim/virtual_board/links/usb_wire.hpp"
#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/adc.hpp"
#include "sim/virtual_board/peripherals/dac.hpp"
#include "sim/virtual_board/peripherals/dma.hpp"
#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/flash.hpp"
#include "sim/virtual_board/peripherals/gpio.hpp"
#include "sim/virtual_board/peripherals/iwdg.hpp"
#include "sim/virtual_board/peripherals/opamp.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/stored_registers.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/usart.hpp"
#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {

/// Results of the four converters at one time, as read from DR, and the coil drive at that time.
struct SampleRecord {
    Ticks time = 0;
    std::array<std::uint16_t, kChannels> codes{};  // sensor coils 1-3, reference
    std::uint8_t gain = 0;                         // of the op-amps
    std::uint8_t driven = 0;                       // enable lines that are high, one bit per source coil
};

class VirtualBoard {
public:
    /// `scenario` must outlive the board. Throws std::invalid_argument for an invalid image.
    VirtualBoard(std::span<const std::uint8_t> image, const sim::Scenario& scenario);

    /// Power off and on again: RAM is lost, flash is kept.
    void power_cycle();
    /// Loses power, and restores it, in the middle of the n-th flash erase or program operation from now on; 0 is the next one.
    void lose_power_in_flash_operation(std::uint64_t n);
    /// Throws RunFailure; its message begins with the pc.
    void run_until(double time_s) { machine.run_until(ticks(time_s)); }
    [[nodiscard]] double now_s() const { return seconds(machine.now()); }

    /// Number of resets since power-on, without the power-on reset.
    [[nodiscard]] unsigned resets() const { return resets_; }

    /// Called with each set of converter results; may be empty.
    std::function<void(const SampleRecord&)> on_sample;
    /// Stops the main program in an endless loop; interrupts continue, unless `with_interrupts` is false.
    void hang(bool with_interrupts);

    Gpio& gpio(char port) { return *gpio_[static_cast<std::size_t>(port - 'A')]; }
    [[nodiscard]] const Gpio& gpio(char port) const { return *gpio_[static_cast<std::size_t>(port - 'A')]; }
    /// Converter 1, 3, 4 or 5.
    Adc& adc(unsigned number);

    Machine machine;
    Rcc rcc;
    Pwr pwr;
    Flash flash;
    Dma dma;
    Usart usart;
    Usb usb;
    Fdcan fdcan;
    CoilBench bench;
    SerialLine serial;
    CanWire can;
    UsbWire usb_wire;
    std::array<SensorAmplifier, kSensorCoils> amplifiers;

private:
    void attach();
    void check_frequency(double hz) const;
    void convert();
    void trigger();
    void drive();
    void update_outputs();
    void record(std::size_t channel, std::uint32_t result);
    [[nodiscard]] double internal_dac_v(unsigned channel) const;
    [[nodiscard]] std::uint32_t code_of(unsigned channel);
    [[nodiscard]] double sensor_noise_codes(double gain, double step_s) const;
    void restart(ResetCause cause);

    std::array<std::unique_ptr<Gpio>, 7> gpio_;
    Timer timer_2_;
    Timer timer_6_;
    Dac dac_1_;
    Dac dac_2_;
    Dac dac_3_;
    Dac dac_4_;
    AdcCommon common_12_;
    AdcCommon common_345_;
    std::array<std::unique_ptr<Adc>, kChannels> adcs_;  // by channel: sensor coils 1-3, reference
    Opamp opamp_;
    Iwdg watchdog_;
    StoredRegisters<5> clock_recovery_;
    StoredRegisters<8> system_configuration_;
    std::mt19937_64 random_;
    std::normal_distribution<double> normal_{0, 1};
    SampleRecord sample_;
    Ticks triggered_ = 0;
    Ticks triggered_by_ = 0;  // ticks per cycle at the time triggered_
    Ticks last_conversion_ = 0;
    bool heartbeat_ = false;
    ResetCause cause_ = ResetCause::software;
    unsigned resets_ = 0;
};

}  // namespace tricoil::virtual_board
