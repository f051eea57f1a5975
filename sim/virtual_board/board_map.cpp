// Memory map of the chip and wiring of its pins.
#include <fmt/format.h>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr unsigned kHeartbeatPin = 9;  // port C
constexpr unsigned kLedPin = 5;        // port A
constexpr unsigned kFdcanEnable = 25;

/// Wake-up pins 1 to 5 of PWR.
struct WakePin {
    char port;
    unsigned pin;
    unsigned number;
};
constexpr std::array<WakePin, 5> kWakePins{{{'A', 0, 1}, {'C', 13, 2}, {'E', 6, 3}, {'A', 2, 4}, {'C', 5, 5}}};

/// Pins of a CAN controller.
struct CanPins {
    char port;
    unsigned receive;
    char send_port;
    unsigned send;
    unsigned function;
};
constexpr std::array<std::array<CanPins, 3>, 3> kCanPins{
    {{{{'A', 11, 'A', 12, 9}, {'B', 8, 'B', 9, 9}, {'D', 0, 'D', 1, 9}}},
     {{{'B', 5, 'B', 6, 9}, {'B', 12, 'B', 13, 9}, {'B', 5, 'B', 6, 9}}},
     {{{'A', 8, 'A', 15, 11}, {'B', 3, 'B', 4, 11}, {'A', 8, 'A', 15, 11}}}}};

}  // namespace

void VirtualBoard::add(const std::string& name, std::uint32_t base, std::uint32_t size, Peripheral& device,
                       std::uint32_t enable_register, unsigned bit) {
    machine.bus.attach({name, base, size, &device,
                        enable_register == 0 ? std::function<bool()>{} : rcc.clock(enable_register, bit), &device == &pwr});
    resettable_.push_back({{enable_register, bit}, &device});
}

void VirtualBoard::reset_peripheral(std::uint32_t enable_register, unsigned bit) {
    for (const auto& [enable, device] : resettable_) {
        if (enable.first == enable_register && enable.second == bit) {
            device->reset();
        }
    }
}

void VirtualBoard::attach() {
    add("DMA1", 0x40020000, 0x400, dma.controller(0), Rcc::kAhb1, 0);
    add("DMA2", 0x40020400, 0x400, dma.controller(1), Rcc::kAhb1, 1);
    add("DMAMUX1", 0x40020800, 0x400, dma.multiplexer(), Rcc::kAhb1, 2);
    attach_analog();
    attach_pins();
    general.attach([this](const std::string& name, std::uint32_t base, std::uint32_t size, Peripheral& device,
                          std::uint32_t enables, unsigned bit) { add(name, base, size, device, enables, bit); });
    attach_can();
    add("CRS", 0x40002000, 0x400, clock_recovery_, Rcc::kApb1, 8);
    add("IWDG", 0x40003000, 0x400, watchdog_);
    add("USB", 0x40005C00, 0x400, usb, Rcc::kApb1, 23);
    add("USB memory", 0x40006000, 0x400, usb.memory(), Rcc::kApb1, 23);
    add("PWR", 0x40007000, 0x400, pwr, Rcc::kApb1, 28);
    add("RCC", 0x40021000, 0x400, rcc);
    add("FLASH", 0x40022000, 0x400, flash);
    add("other flash bank", Memory::kFlashBase + Memory::kBankBytes, Memory::kBankBytes, flash.other_bank());
    add("DBGMCU", 0xE0042000, 0x400, debug_unit_);
}

void VirtualBoard::attach_data_pages() {
    machine.cpu.map_data_pages();
    for (std::size_t n = 0; n < Memory::kDataPages.size(); ++n) {
        add("data page", Memory::kFlashBase + Memory::kDataPages[n].offset, Memory::kDataPages[n].bytes, flash.data_page(n));
    }
}

void VirtualBoard::attach_analog() {
    add("DAC1", 0x50000800, 0x400, dac_1_, Rcc::kAhb2, 16);
    add("DAC2", 0x50000C00, 0x400, dac_2_, Rcc::kAhb2, 17);
    add("DAC3", 0x50001000, 0x400, dac_3_, Rcc::kAhb2, 18);
    add("DAC4", 0x50001400, 0x400, dac_4_, Rcc::kAhb2, 19);
    add("ADC1", 0x50000000, 0x100, *adcs_[3], Rcc::kAhb2, 13);
    add("ADC2", 0x50000100, 0x100, adc_2_, Rcc::kAhb2, 13);
    add("ADC12", 0x50000300, 0x100, common_12_, Rcc::kAhb2, 13);
    add("ADC3", 0x50000400, 0x100, *adcs_[0], Rcc::kAhb2, 14);
    add("ADC4", 0x50000500, 0x100, *adcs_[1], Rcc::kAhb2, 14);
    add("ADC5", 0x50000600, 0x100, *adcs_[2], Rcc::kAhb2, 14);
    add("ADC345", 0x50000700, 0x100, common_345_, Rcc::kAhb2, 14);
    add("OPAMP", 0x40010300, 0x30, opamp_, Rcc::kApb2, 0);
}

void VirtualBoard::attach_pins() {
    for (unsigned n = 0; n < gpio_.size(); ++n) {
        add(fmt::format("GPIO{}", static_cast<char>('A' + n)), 0x48000000 + 0x400 * n, 0x400, *gpio_[n], Rcc::kAhb2, n);
    }
    add("SYSCFG", 0x40010000, 0x30, system_configuration_, Rcc::kApb2, 0);
    add("EXTI", 0x40010400, 0x400, exti, Rcc::kApb2, 0);
}

void VirtualBoard::attach_can() {
    for (std::uint32_t n = 0; n < fdcans.size(); ++n) {
        add(fmt::format("FDCAN{}", n + 1), 0x40006400 + 0x400 * n, 0x400, *fdcans[n], Rcc::kApb1, kFdcanEnable);
        add(fmt::format("FDCAN{} memory", n + 1), 0x4000A400 + Fdcan::kMemoryBytes * n, Fdcan::kMemoryBytes, fdcans[n]->memory(),
            Rcc::kApb1, kFdcanEnable);
        fdcans[n]->check_pins = [this, n] { check_can_pins(n); };
    }
}

void VirtualBoard::check_can_pins(unsigned number) const {
    for (const CanPins& pins : kCanPins[number]) {
        if (gpio(pins.port).is_alternate(pins.receive, pins.function) &&
            gpio(pins.send_port).is_alternate(pins.send, pins.function)) {
            const bool pulled_down = pins.send_port == 'B' && (pins.send == 4 || pins.send == 6) && !pwr.dead_battery_disabled();
            if (!pulled_down) {
                return;
            }
        }
    }
    const CanPins& usual = kCanPins[number][0];
    throw RunFailure(
        fmt::format("FDCAN{} sends, but its pins are not configured, for example P{}{} and P{}{} with AF{} (PB4 and "
                    "PB6 with UCPD1_DBDIS)",
                    number + 1, usual.port, usual.receive, usual.send_port, usual.send, usual.function));
}

void VirtualBoard::wire_pins() {
    for (unsigned n = 0; n < gpio_.size(); ++n) {
        gpio_[n]->on_change = [this, port = static_cast<char>('A' + n)] { pin_changed(port); };
    }
    exti.level_of = [this](unsigned line) {
        const std::uint32_t port = field(system_configuration_[0x08 + 4 * (line / 4)], 4 * (line % 4), 3);
        return gpio_[std::min<std::size_t>(port, gpio_.size() - 1)]->level(line);
    };
    press_button(false);
    set_stage_hot(false);
}

void VirtualBoard::pin_changed(char port) {
    if (port == 'C') {
        update_outputs();
    }
    if (port == 'A' && gpio('A').drives_high(kLedPin) != led_) {
        led_ = !led_;
        ++led_changes_;
    }
    if (exti.is_watching()) {
        exti.check_pins();
    }
    for (const WakePin& wake : kWakePins) {
        if (wake.port == port) {
            pwr.set_wake_pin(wake.number, gpio(port).outside_is_high(wake.pin));
        }
    }
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

}  // namespace tricoil::virtual_board
