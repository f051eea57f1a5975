#include "sim/virtual_board/peripherals/gpio.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kInput = 0x10;
constexpr std::uint32_t kOutput = 0x14;
constexpr std::uint32_t kSetReset = 0x18;
constexpr std::uint32_t kReset = 0x28;

}  // namespace

Gpio::Gpio(std::uint32_t modes, std::uint32_t speeds, std::uint32_t pulls)
    : registers_{{0x00, modes},  {0x04, 0}, {0x08, speeds}, {0x0C, pulls}, {kInput, 0}, {kOutput, 0},
                 {kSetReset, 0}, {0x1C, 0}, {0x20, 0},      {0x24, 0},     {kReset, 0}} {}

std::uint32_t Gpio::read(std::uint32_t offset) {
    if (offset != kInput) {
        return registers_.at(offset);
    }
    std::uint32_t levels = 0;
    for (unsigned pin = 0; pin < 16; ++pin) {
        const bool pulled_up = mode(pin) == Mode::input && field(registers_[0x0C], 2 * pin, 2) == 1;
        levels |= flag(drives_high(pin) || pulled_up, pin);
    }
    return levels;
}

void Gpio::write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case kInput:
            throw RunFailure("IDR is read-only");
        case kSetReset:
            registers_.at(kOutput) = (registers_[kOutput] & ~(value >> 16U)) | (value & 0xFFFFU);
            break;
        case kReset:
            registers_.at(kOutput) &= ~value;
            break;
        default:
            registers_.at(offset) = value;
    }
    if (on_change) {
        on_change();
    }
}

void Gpio::reset() {
    registers_.reset();
    if (on_change) {
        on_change();
    }
}

}  // namespace tricoil::virtual_board
