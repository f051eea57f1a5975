#include "sim/virtual_board/machine/machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace tricoil::virtual_board {

Machine::Machine()
    : nvic(events),
      control(nvic, [this] { request_reset(); }),
      cpu(memory, bus, events, nvic, control),
      sys_tick_(events, nvic, [this] { return cpu.ticks_per_cycle(); }),
      cycle_counter_(cpu.cycles()),
      ram_bits_([this](std::uint32_t at) { return memory.word(Memory::kRamBase + at); },
                [this](std::uint32_t at, std::uint32_t word) { std::memcpy(memory.ram.data() + at, &word, sizeof word); }),
      peripheral_bits_([this](std::uint32_t at) { return bus.read(0x40000000 + at, 4); },
                       [this](std::uint32_t at, std::uint32_t word) { bus.write(0x40000000 + at, word, 4); }) {
    bus.attach({"SysTick", 0xE000E010, 0x10, &sys_tick_, {}});
    bus.attach({"NVIC", 0xE000E100, 0x400, &nvic, {}});
    bus.attach({"SCB", 0xE000ED00, 0x300, &control, {}});
    bus.attach({"DWT", 0xE0001000, 0x1000, &cycle_counter_, {}});
    bus.attach({"ITM", 0xE0000000, 0x1000, &trace_, {}});
    bus.attach({"bit-band of the RAM", Memory::kRamBitsBase, 32 * Memory::kRamBytes, &ram_bits_, {}});
    bus.attach({"bit-band of the peripherals", 0x42000000, 0x2000000, &peripheral_bits_, {}});
}

void Machine::load(std::span<const std::uint8_t> image) {
    if (image.size() < 4 * kFirstInterrupt || image.size() > memory.flash.size()) {
        throw std::invalid_argument(fmt::format("image of {} bytes: give a raw .bin of {} to {} bytes for flash address {:#010x}",
                                                image.size(), 4 * kFirstInterrupt, memory.flash.size(), Memory::kFlashBase));
    }
    std::fill(memory.flash.begin(), memory.flash.end(), 0xFF);
    std::copy(image.begin(), image.end(), memory.flash.begin());
    const std::uint32_t stack = memory.word(Memory::kFlashBase);
    const std::uint32_t start = memory.word(Memory::kFlashBase + 4);
    const bool stack_in_ram = stack > Memory::kRamBase && stack <= Memory::kRamBase + Memory::kRamBytes;
    const bool start_in_image = (start & 1U) != 0 && start - Memory::kFlashBase < image.size();
    if (!stack_in_ram || !start_in_image) {
        throw std::invalid_argument(
            fmt::format("image does not begin with a vector table for flash at {:#010x} (stack {:#010x}, reset "
                        "{:#010x}); give a raw .bin that is linked for this address",
                        Memory::kFlashBase, stack, start));
    }
}

void Machine::set_core_clock(Ticks ticks_per_cycle) {
    const std::uint32_t count = sys_tick_.count();
    cpu.set_ticks_per_cycle(ticks_per_cycle);
    sys_tick_.count_from(count);
}

void Machine::reset() {
    events.forget_frozen();
    bus.reset();
    cpu.reset();
}

void Machine::request_reset() {
    reset_requested_ = true;
    cpu.stop_soon();
}

void Machine::run_until(Ticks time) {
    while (events.now() < time && !cpu.in_bootloader()) {
        cpu.run_until(time);
        if (reset_requested_) {
            reset_requested_ = false;
            on_reset_request();
            reset();
        }
    }
}

}  // namespace tricoil::virtual_board
