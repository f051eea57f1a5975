// The STM32G474RE on its Nucleo board, with coils in front and links behind: what the flash image runs on.
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
#include "sim/virtual_board/peripherals/plain.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/usart.hpp"
#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {

/// What the four converters gave at one time, as DR had it, and what the coils were driven with.
struct SampleRecord {
    Ticks time = 0;
    std::array<std::uint16_t, kChannels> codes{};  // sensor coils 1-3, reference
    std::uint8_t gain = 0;                         // of the op-amps
    std::uint8_t driven = 0;                       // enable lines that are high: a bit per source coil
};

class VirtualBoard {
public:
    /// `scenario` must outlive the board. Throws std::invalid_argument for what is no image.
    VirtualBoard(std::span<const std::uint8_t> image, const sim::Scenario& scenario);

    /// Power off and on again: RAM is lost, flash stays.
    void power_cycle();
    /// Power is lost, and comes back, in the middle of the n-th erasing or programming of flash from now on; 0 is the next.
    void lose_power_in_flash_operation(std::uint64_t n);
    /// Throws RunFailure, beginning with the pc.
    void run_until(double time_s) { machine.run_until(ticks(time_s)); }
    [[nodiscard]] double now_s() const { return seconds(machine.now()); }

    /// Resets since power-on that were not the first.
    [[nodiscard]] unsigned resets() const { return resets_; }

    /// Sees each set of results of the converters; may not be set.
    std::function<void(const SampleRecord&)> on_sample;
    /// The main program does nothing any more; interrupts go on unless they are masked too.
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
    void see_outputs();
    void record(std::size_t channel, std::uint32_t result);
    [[nodiscard]] double inside_v(unsigned channel) const;
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
    std::array<std::unique_ptr<Adc>, kChannels> adcs_;  // by channel: of sensor coils 1-3, and of the reference
    Opamp opamp_;
    Iwdg watchdog_;
    Plain<5> clock_recovery_;
    Plain<8> system_configuration_;
    std::mt19937_64 random_;
    std::normal_distribution<double> normal_{0, 1};
    SampleRecord sample_;
    Ticks triggered_ = 0;
    Ticks triggered_by_ = 0;  // ticks of a cycle then
    Ticks last_conversion_ = 0;
    bool heartbeat_ = false;
    ResetCause cause_ = ResetCause::software;
    unsigned resets_ = 0;
};

}  // namespace tricoil::virtual_board
