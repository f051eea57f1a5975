#include "sim/virtual_board/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace tricoil::virtual_board {
namespace {

// Interrupt lines (RM0440, vector table) and trigger numbers.
constexpr int kUsart2Line = 38;
constexpr int kUsbLine = 20;
constexpr int kFdcan2Line = 86;
constexpr int kTimer2Line = 28;
constexpr int kTimer6Line = 54;
constexpr unsigned kDacTimer6 = 7;
constexpr unsigned kAdcTimer6 = 13;

/// Op-amp and ADC channel of one sensor coil; the pins are in the board's wiring table. `dac`, `dac_channel`: the on-chip DAC
/// that the op-amp can select as its input instead (RM0440, "OPAMP non-inverting inputs").
struct SensorInput {
    char port;
    unsigned pin;
    unsigned amplifier;
    unsigned channel;
    unsigned dac;
    unsigned dac_channel;  // 0, 1
};
constexpr std::array<SensorInput, kSensorCoils> kSensors{{{'B', 0, 3, 13, 3, 1}, {'B', 12, 6, 17, 3, 0}, {'B', 13, 4, 5, 4, 0}}};
constexpr unsigned kReferencePin = 0;                               // PA0
constexpr unsigned kReferenceInput = 1;                             // ADC1_IN1
constexpr std::array<unsigned, kSourceCoils> kDrivePins{4, 5, 6};   // port A
constexpr std::array<unsigned, kSourceCoils> kEnablePins{6, 7, 8};  // port C
constexpr unsigned kHeartbeatPin = 9;                               // port C

constexpr double kCodes = 4096;
constexpr double kConverterNoiseCodes = 0.67;  // together with quantisation: 66 dB (DS12288)
// Length in half-words of the endless loop at the end of flash bank 1, for hang(). The loop is long, because the emulator runs
// short loops slowly.
constexpr std::uint32_t kIdleNops = 1000;
constexpr std::uint32_t kIdleLoop = Memory::kBankBytes - 2 * (kIdleNops + 2);
constexpr std::uint16_t kNop = 0xBF00;

/// Writes nops and a branch back to the first one (ARMv7-M A7.7.12, encoding T2).
void put_idle_loop(Memory& memory) {
    for (std::uint32_t n = 0; n <= kIdleNops; ++n) {
        const bool last = n == kIdleNops;
        const std::uint32_t half = last ? 0xE000U | ((2048U - n - 2U) & 0x7FFU) : kNop;
        memory.flash[kIdleLoop + 2 * n] = static_cast<std::uint8_t>(half);
        memory.flash[kIdleLoop + 2 * n + 1] = static_cast<std::uint8_t>(half >> 8U);
    }
}

}  // namespace

VirtualBoard::VirtualBoard(std::span<const std::uint8_t> image, const sim::Scenario& scenario)
    : rcc(machine),
      pwr(machine),
      flash(machine),
      dma(machine),
      usart(machine, kUsart2Line),
      usb(machine, kUsbLine, [this] { return rcc.has_48_mhz(); }),
      fdcan(machine, kFdcan2Line, [this] { return field(rcc.kernel_clocks(), 24, 2) == 2 ? rcc.core_hz() : 0; }),
      bench(scenario),
      serial(machine, usart),
      can(machine, fdcan),
      usb_wire(machine, usb),
      timer_2_(machine, 32, kTimer2Line),
      timer_6_(machine, 16, kTimer6Line),
      dac_1_(dma, {6, 7}, [this] { return rcc.core_hz(); }),
      dac_2_(dma, {41, 0}, [this] { return rcc.core_hz(); }),
      dac_3_(dma, {102, 103}, [this] { return rcc.core_hz(); }),
      dac_4_(dma, {104, 105}, [this] { return rcc.core_hz(); }),
      adcs_{std::make_unique<Adc>(machine, dma, common_345_, AdcParams{37, 47}),
            std::make_unique<Adc>(machine, dma, common_345_, AdcParams{38, 61}),
            std::make_unique<Adc>(machine, dma, common_345_, AdcParams{39, 62}),
            std::make_unique<Adc>(machine, dma, common_12_, AdcParams{5, 18})},
      watchdog_(machine,
                [this] {
                    cause_ = ResetCause::watchdog;
                    machine.request_reset();
                }),
      clock_recovery_(virtual_board::clock_recovery()),
      system_configuration_(virtual_board::system_configuration()),
      random_(scenario.world.seed + 2) {
    for (std::size_t n = 0; n < gpio_.size(); ++n) {
        gpio_[n] = n == 0   ? std::make_unique<Gpio>(0xABFFFFFF, 0x0C000000, 0x64000000)
                   : n == 1 ? std::make_unique<Gpio>(0xFFFFFEBF, 0x000000C0, 0x00000100)
                            : std::make_unique<Gpio>(0xFFFFFFFF, 0, 0);
    }
    std::mt19937_64 factory(scenario.world.seed + 3);
    amplifiers = {SensorAmplifier(factory), SensorAmplifier(factory), SensorAmplifier(factory)};
    attach();
    gpio('C').on_change = [this] { update_outputs(); };
    timer_6_.on_trigger.emplace_back([this] { trigger(); });
    rcc.check_frequency = [this](double hz) { check_frequency(hz); };
    usart.check_pins = [this] {
        if (!gpio('A').is_alternate(2, 7)) {
            throw RunFailure("USART2 sends, but PA2 is not configured as its pin (AF7)");
        }
    };
    fdcan.check_pins = [this] {
        if (!gpio('B').is_alternate(5, 9) || !gpio('B').is_alternate(6, 9) || !pwr.dead_battery_disabled()) {
            throw RunFailure("FDCAN2 sends, but PB5 and PB6 are not configured as its pins (AF9, UCPD1_DBDIS)");
        }
    };
    for (std::size_t n = 0; n < kChannels; ++n) {
        adcs_[n]->on_result = [this, n](std::uint32_t result) { record(n, result); };
    }
    machine.on_reset_request = [this] { restart(std::exchange(cause_, ResetCause::software)); };
    machine.load(image);
    put_idle_loop(machine.memory);
    power_cycle();
}

void VirtualBoard::attach() {
    const auto add = [this](const char* name, std::uint32_t base, std::uint32_t size, Peripheral& device,
                            std::function<bool()> clock) {
        machine.bus.attach({name, base, size, &device, std::move(clock)});
    };
    add("DMA1", 0x40020000, 0x400, dma, rcc.clock(Rcc::kAhb1, 0));
    add("DMAMUX1", 0x40020800, 0x400, dma.multiplexer(), rcc.clock(Rcc::kAhb1, 2));
    add("DAC1", 0x50000800, 0x400, dac_1_, rcc.clock(Rcc::kAhb2, 16));
    add("DAC2", 0x50000C00, 0x400, dac_2_, rcc.clock(Rcc::kAhb2, 17));
    add("DAC3", 0x50001000, 0x400, dac_3_, rcc.clock(Rcc::kAhb2, 18));
    add("DAC4", 0x50001400, 0x400, dac_4_, rcc.clock(Rcc::kAhb2, 19));
    add("ADC1", 0x50000000, 0x100, *adcs_[3], rcc.clock(Rcc::kAhb2, 13));
    add("ADC12", 0x50000300, 0x100, common_12_, rcc.clock(Rcc::kAhb2, 13));
    add("ADC3", 0x50000400, 0x100, *adcs_[0], rcc.clock(Rcc::kAhb2, 14));
    add("ADC4", 0x50000500, 0x100, *adcs_[1], rcc.clock(Rcc::kAhb2, 14));
    add("ADC5", 0x50000600, 0x100, *adcs_[2], rcc.clock(Rcc::kAhb2, 14));
    add("ADC345", 0x50000700, 0x100, common_345_, rcc.clock(Rcc::kAhb2, 14));
    for (unsigned n = 0; n < gpio_.size(); ++n) {
        static constexpr std::array kNames{"GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG"};
        add(kNames[n], 0x48000000 + 0x400 * n, 0x400, *gpio_[n], rcc.clock(Rcc::kAhb2, n));
    }
    add("TIM2", 0x40000000, 0x400, timer_2_, rcc.clock(Rcc::kApb1, 0));
    add("TIM6", 0x40001000, 0x400, timer_6_, rcc.clock(Rcc::kApb1, 4));
    add("CRS", 0x40002000, 0x400, clock_recovery_, rcc.clock(Rcc::kApb1, 8));
    add("IWDG", 0x40003000, 0x400, watchdog_, {});
    add("USART2", 0x40004400, 0x400, usart, rcc.clock(Rcc::kApb1, 17));
    add("USB", 0x40005C00, 0x400, usb, rcc.clock(Rcc::kApb1, 23));
    add("USB memory", 0x40006000, 0x400, usb.memory(), rcc.clock(Rcc::kApb1, 23));
    add("FDCAN2", 0x40006800, 0x400, fdcan, rcc.clock(Rcc::kApb1, 25));
    add("FDCAN2 memory", 0x4000A400 + Fdcan::kMemoryBytes, Fdcan::kMemoryBytes, fdcan.memory(), rcc.clock(Rcc::kApb1, 25));
    add("PWR", 0x40007000, 0x400, pwr, rcc.clock(Rcc::kApb1, 28));
    add("SYSCFG", 0x40010000, 0x30, system_configuration_, rcc.clock(Rcc::kApb2, 0));
    add("OPAMP", 0x40010300, 0x30, opamp_, rcc.clock(Rcc::kApb2, 0));
    add("RCC", 0x40021000, 0x400, rcc, {});
    add("FLASH", 0x40022000, 0x400, flash, {});
    add("flash bank 2", Memory::kFlashBase + Memory::kBankBytes, Memory::kBankBytes, flash.bank(), {});
}

Adc& VirtualBoard::adc(unsigned number) { return *adcs_.at(number == 1 ? 3 : number - 3); }

void VirtualBoard::check_frequency(double hz) const {
    if (hz > 150e6 && !pwr.is_boosted()) {
        throw RunFailure("core clock above 150 MHz without boost mode (PWR_CR5.R1MODE)");
    }
    const double hz_per_state = pwr.is_boosted() ? 34e6 : 30e6;  // RM0440, table of flash wait states
    if (hz > hz_per_state * (flash.wait_states() + 1)) {
        throw RunFailure(fmt::format("{} flash wait states are too few for {:.0f} MHz", flash.wait_states(), hz / 1e6));
    }
}

void VirtualBoard::power_cycle() {
    flash.lose_power();
    machine.memory.lose_ram();
    restart(ResetCause::power);
    resets_ = 0;
    machine.reset();
}

void VirtualBoard::lose_power_in_flash_operation(std::uint64_t n) {
    flash.interrupt_operation(n, [this] {
        flash.lose_power();
        machine.memory.lose_ram();
        cause_ = ResetCause::power;
        machine.request_reset();
    });
}

void VirtualBoard::restart(ResetCause cause) {
    rcc.set_reset_cause(cause);
    ++resets_;
    if (cause == ResetCause::power) {
        for (SensorAmplifier& amplifier : amplifiers) {
            amplifier.lose_power();
        }
    }
}

void VirtualBoard::hang(bool with_interrupts) { machine.cpu.jump(Memory::kFlashBase + kIdleLoop, !with_interrupts); }

/// The converter of the reference channel finishes last.
void VirtualBoard::record(std::size_t channel, std::uint32_t result) {
    sample_.codes[channel] = static_cast<std::uint16_t>(result);
    if (channel != kReferenceChannel || !on_sample) {
        return;
    }
    sample_.time = machine.now();
    sample_.gain = static_cast<std::uint8_t>(opamp_.gain(kSensors[0].amplifier));
    sample_.driven = 0;
    for (unsigned j = 0; j < kSourceCoils; ++j) {
        sample_.driven = static_cast<std::uint8_t>(sample_.driven | flag(gpio('C').drives_high(kEnablePins[j]), j));
    }
    on_sample(sample_);
}

void VirtualBoard::update_outputs() {
    bench.advance(now_s());
    const bool heartbeat = gpio('C').drives_high(kHeartbeatPin);
    if (heartbeat != heartbeat_) {
        heartbeat_ = heartbeat;
        bench.heartbeat(now_s());
    }
    drive();
}

void VirtualBoard::drive() {
    const std::array<std::pair<const Dac*, unsigned>, kSourceCoils> outputs{{{&dac_1_, 0}, {&dac_1_, 1}, {&dac_2_, 0}}};
    for (unsigned j = 0; j < kSourceCoils; ++j) {
        const auto& [dac, channel] = outputs[j];
        const bool is_connected = dac->is_on(channel) && !dac->is_inside(channel) && gpio('A').is_analog(kDrivePins[j]);
        const double swing = is_connected ? dac->code(channel) / kCodes * CoilBench::kSupplyV - CoilBench::kHalfSupplyV : 0;
        bench.drive(static_cast<int>(j), swing, gpio('C').drives_high(kEnablePins[j]));
    }
}

/// Output voltage of the on-chip DAC that a sensor channel's op-amp can select as its input.
double VirtualBoard::internal_dac_v(unsigned channel) const {
    const SensorInput& input = kSensors[channel];
    const Dac& dac = input.dac == 3 ? dac_3_ : dac_4_;
    if (!dac.is_on(input.dac_channel) || !dac.is_inside(input.dac_channel)) {
        return -CoilBench::kHalfSupplyV;
    }
    return dac.code(input.dac_channel) / kCodes * CoilBench::kSupplyV - CoilBench::kHalfSupplyV;
}

double VirtualBoard::sensor_noise_codes(double gain, double step_s) const {
    return bench.noise_v_per_sqrt_hz() * std::sqrt(0.5 / step_s) * gain * kCodes / CoilBench::kSupplyV;
}

std::uint32_t VirtualBoard::code_of(unsigned channel) {
    const Adc& adc = *adcs_[channel];
    double volts = -CoilBench::kHalfSupplyV;  // an unconnected input, or an op-amp that is off
    double noise = kConverterNoiseCodes;
    const double step_s = std::max(seconds(machine.now() - last_conversion_), 1e-9);
    if (channel == kReferenceChannel) {
        if (adc.channel() == kReferenceInput && gpio('A').is_analog(kReferencePin)) {
            volts = bench.reference_v();
        }
    } else {
        const SensorInput& input = kSensors[channel];
        const double gain = opamp_.gain(input.amplifier);
        if (gain > 0 && adc.channel() == input.channel && gpio(input.port).is_analog(input.pin)) {
            SensorAmplifier& amplifier = amplifiers[channel];
            if (opamp_.input(input.amplifier) == Opamp::Input::dac) {
                amplifier.jump(internal_dac_v(channel), gain, step_s, seconds(adc.sampling_time()));
            } else {
                amplifier.follow(bench.sensor_v(static_cast<int>(channel)), gain, step_s);
                noise = std::hypot(noise, sensor_noise_codes(gain, step_s));
            }
            noise = std::hypot(noise, amplifier.noise_v(gain) * kCodes / CoilBench::kSupplyV);
            volts = amplifier.output_v();
        }
    }
    const double code = (volts + CoilBench::kHalfSupplyV) * kCodes / CoilBench::kSupplyV + noise * normal_(random_);
    const bool stuck = bench.is_stuck(static_cast<int>(channel));
    return stuck ? 2048U : static_cast<std::uint32_t>(std::clamp(std::nearbyint(code), 0.0, kCodes - 1));
}

/// Conversions started by the last trigger are finished at the next one. The difference is not visible, because nothing else
/// reads the results.
void VirtualBoard::convert() {
    const auto busy = std::find_if(adcs_.begin(), adcs_.end(), [](const auto& adc) { return adc->is_converting(); });
    if (busy == adcs_.end()) {
        return;
    }
    const bool steady = triggered_by_ == machine.cpu.ticks_per_cycle();  // false if the core clock changed after the trigger
    if (steady && (*busy)->conversion_time() > machine.now() - triggered_) {
        throw RunFailure("a conversion lasts longer than the time between two triggers");
    }
    bench.advance(seconds(triggered_ + (*busy)->sampling_time()));
    std::array<std::uint32_t, kChannels> codes{};
    for (unsigned n = 0; n < kChannels; ++n) {
        codes[n] = code_of(n);
    }
    last_conversion_ = machine.now();
    for (unsigned n = 0; n < kChannels; ++n) {
        if (adcs_[n]->is_converting()) {
            adcs_[n]->finish(codes[n]);
        }
    }
}

void VirtualBoard::trigger() {
    convert();
    bench.advance(now_s());
    dac_1_.trigger(kDacTimer6);
    dac_2_.trigger(kDacTimer6);
    dac_3_.trigger(kDacTimer6);
    dac_4_.trigger(kDacTimer6);
    drive();
    for (const auto& adc : adcs_) {
        adc->trigger(kAdcTimer6);
    }
    triggered_ = machine.now();
    triggered_by_ = machine.cpu.ticks_per_cycle();
}

}  // namespace tricoil::virtual_board
