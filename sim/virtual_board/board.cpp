#include "sim/virtual_board/board.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace tricoil::virtual_board {
namespace {

// Interrupt lines (RM0440, vector table).
constexpr int kUsbLine = 20;
constexpr std::array<std::array<int, 2>, 3> kFdcanLines{{{21, 22}, {86, 87}, {88, 89}}};
constexpr int kTimer6DacLine = 54;
constexpr int kTimer7DacLine = 55;
constexpr std::uint32_t kImageMark = 0x2200;  // of the image of a tracker board (board/stm32g4/image_header.hpp)
constexpr std::uint32_t kMemoryMap = 0;       // MEMRMP of SYSCFG
constexpr unsigned kAdc12Clock = 28;          // fields of CCIPR
constexpr unsigned kAdc345Clock = 30;

}  // namespace

VirtualBoard::VirtualBoard(std::span<const std::uint8_t> image, const sim::Scenario& scenario, const BoardCircuit& parts)
    : rcc(machine),
      pwr(machine),
      flash(machine),
      dma(machine),
      exti(machine),
      general(machine, dma, rcc, [this](const TransmitPin& p) { return gpio(p.port).is_alternate(p.pin, p.function); }),
      usb(machine, kUsbLine, [this] { return rcc.has_48_mhz(); }),
      fdcans{std::make_unique<Fdcan>(machine, kFdcanLines[0], [this] { return rcc.fdcan_hz() / fdcans[0]->clock_divider(); }),
             std::make_unique<Fdcan>(machine, kFdcanLines[1], [this] { return rcc.fdcan_hz() / fdcans[0]->clock_divider(); }),
             std::make_unique<Fdcan>(machine, kFdcanLines[2], [this] { return rcc.fdcan_hz() / fdcans[0]->clock_divider(); })},
      circuit(parts),
      bench(scenario, circuit),
      serial(machine, {{&general.serial(2), [this] { return gpio('A').is_alternate(2, 7); }},
                       {&general.serial(0), [this] { return gpio('A').is_alternate(2, 12); }}}),
      can(machine, {fdcans[0].get(), fdcans[1].get(), fdcans[2].get()}),
      usb_wire(machine, usb),
      dac_1_(machine, dma, {kTimer6DacLine, 1}, {6, 7}, [this] { return rcc.core_hz(); }),
      dac_2_(machine, dma, {kTimer7DacLine, 1}, {41, 0}, [this] { return rcc.core_hz(); }),
      dac_3_(machine, dma, {kTimer6DacLine, 2}, {102, 103}, [this] { return rcc.core_hz(); }),
      dac_4_(machine, dma, {kTimer7DacLine, 2}, {104, 105}, [this] { return rcc.core_hz(); }),
      common_12_([this] { return machine.cpu.ticks_per_cycle(); }, [this] { return ticks_of_cycle(rcc.adc_hz(kAdc12Clock)); }),
      common_345_([this] { return machine.cpu.ticks_per_cycle(); }, [this] { return ticks_of_cycle(rcc.adc_hz(kAdc345Clock)); }),
      adcs_{std::make_unique<Adc>(machine, dma, common_345_, AdcParams{37, 47}),
            std::make_unique<Adc>(machine, dma, common_345_, AdcParams{38, 61}),
            std::make_unique<Adc>(machine, dma, common_345_, AdcParams{39, 62}),
            std::make_unique<Adc>(machine, dma, common_12_, AdcParams{5, {18, 0}})},
      adc_2_(machine, dma, common_12_, {36, {18, 1}}),
      watchdog_(machine,
                [this] {
                    cause_ = ResetCause::watchdog;
                    machine.request_reset();
                }),
      clock_recovery_(virtual_board::clock_recovery()),
      system_configuration_(virtual_board::system_configuration()),
      debug_unit_(virtual_board::debug_unit()),
      random_(scenario.world.seed + 2),
      inside_random_(scenario.world.seed + 4) {
    for (std::size_t n = 0; n < gpio_.size(); ++n) {
        gpio_[n] = n == 0   ? std::make_unique<Gpio>(0xABFFFFFF, 0x0C000000, 0x64000000)
                   : n == 1 ? std::make_unique<Gpio>(0xFFFFFEBF, 0x000000C0, 0x00000100)
                            : std::make_unique<Gpio>(0xFFFFFFFF, 0, 0);
    }
    std::transform(circuit.channels.begin(), circuit.channels.end(), low_pass_.begin(),
                   [](const AnalogChannel& channel) { return LowPass(channel.corner_hz); });
    std::copy_n(low_pass_.begin(), flux_low_pass_.size(), flux_low_pass_.begin());
    attach();
    wire_pins();
    wire_analog();
    wire_low_power();
    system_configuration_.on_change = [this] { flash.exchange_banks(is_set(system_configuration_[kMemoryMap], 8)); };  // FB_MODE
    rcc.check_frequency = [this](double hz) { check_frequency(hz); };
    rcc.check_backup = [this] { fail_if(!pwr.backup_is_writable(), "BDCR is written without PWR_CR1.DBP"); };
    rcc.on_peripheral_reset = [this](std::uint32_t enables, unsigned bit) { reset_peripheral(enables, bit); };
    pwr.check_frequency = [this] { check_frequency(rcc.core_hz()); };
    machine.on_reset_request = [this] { restart(std::exchange(cause_, std::nullopt).value_or(ResetCause::software)); };
    machine.load(image);
    put_injected_code(machine.memory);
    if (std::ranges::equal(std::span(machine.memory.flash).subspan(kImageMark, 4), std::string_view("TRCI"))) {
        attach_data_pages();
    }
    power_cycle();
}

Adc& VirtualBoard::adc(unsigned number) { return *adcs_.at(number == 1 ? 3 : number - 3); }

/// RM0440, table of flash wait states; DS12288, maximum frequencies.
void VirtualBoard::check_frequency(double hz) const {
    struct Limit {
        double hz;
        double hz_per_state;
        const char* text;
    };
    static constexpr std::array<Limit, 4> kLimits{{{170e6, 34e6, "170 MHz in boost mode"},
                                                   {150e6, 30e6, "150 MHz without boost mode (PWR_CR5.R1MODE)"},
                                                   {26e6, 12e6, "26 MHz in range 2 (PWR_CR1.VOS)"},
                                                   {2e6, 2e6, "2 MHz in low-power run mode (PWR_CR1.LPR)"}}};
    const Limit& limit = kLimits[static_cast<std::size_t>(pwr.range())];
    if (hz > limit.hz) {
        const std::string text = fmt::format("core clock of {:.0f} MHz is above {}", hz / 1e6, limit.text);
        fail_if(!machine.bus.on_doubt, "{}", text);
        return machine.bus.on_doubt(text + ": the chip may fail");
    }
    fail_if(hz > limit.hz_per_state * (flash.wait_states() + 1), "{} flash wait states are too few for {:.0f} MHz",
            flash.wait_states(), hz / 1e6);
}

void VirtualBoard::power_cycle() {
    flash.lose_power();
    pwr.lose_power();
    machine.memory.lose_ram();
    restart(ResetCause::power);
    resets_ = 0;
    machine.reset();
}

void VirtualBoard::lose_power_in_flash_operation(std::uint64_t n) {
    flash.interrupt_operation(n, [this] {
        flash.lose_power();
        pwr.lose_power();
        machine.memory.lose_ram();
        cause_ = ResetCause::power;
        machine.request_reset();
    });
}

void VirtualBoard::restart(ResetCause cause) {
    ++resets_;
    if (std::exchange(standby_, false) && cause != ResetCause::power) {
        machine.memory.lose_ram();
        pwr.set_standby_flag();
    }
    rcc.set_reset_cause(cause);
    if (cause == ResetCause::power) {
        for (SensorAmplifier& amplifier : circuit.amplifiers) {
            amplifier.lose_power();
        }
    }
}

void VirtualBoard::inject(InjectedCode code, bool masks_interrupts) {
    if (code != InjectedCode::idle) {
        machine.cpu.take_next_fault();
    }
    machine.cpu.jump(address_of(code), masks_interrupts);
}

void VirtualBoard::wire_low_power() {
    machine.cpu.on_deep_sleep = [this] { sleep_deeply(); };
    machine.cpu.on_deep_wake = [this] {
        machine.events.thaw();
        rcc.leave_stop();
    };
    pwr.on_wake_pin = [this] {
        if (standby_) {
            wake_from_standby();
        }
    };
}

void VirtualBoard::sleep_deeply() {
    machine.events.freeze();
    if (pwr.deep_sleep() == Pwr::DeepSleep::stop) {
        return;
    }
    standby_ = true;
    machine.cpu.halt();
    if (pwr.has_wake_up()) {
        wake_from_standby();
    }
}

/// Leaving shutdown is a power-on reset.
void VirtualBoard::wake_from_standby() {
    if (pwr.deep_sleep() == Pwr::DeepSleep::shutdown) {
        standby_ = false;
        machine.memory.lose_ram();
        cause_ = ResetCause::power;
    } else {
        cause_ = ResetCause::pin;
    }
    machine.request_reset();
}

}  // namespace tricoil::virtual_board
