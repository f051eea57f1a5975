#include "sim/virtual_board/peripherals/gpio.hpp"

namespace tricoil::virtual_board {
namespace gpio {

constexpr std::uint32_t kTypes = 0x04;
constexpr std::uint32_t kPulls = 0x0C;
constexpr std::uint32_t kInput = 0x10;
constexpr std::uint32_t kOutput = 0x14;
constexpr std::uint32_t kSetReset = 0x18;
constexpr std::uint32_t kLock = 0x1C;
constexpr std::uint32_t kHighFunctions = 0x24;
constexpr std::uint32_t kReset = 0x28;
constexpr unsigned kLockKey = 16;
constexpr unsigned kLockSteps = 3;  // writes of the key: 1, 0, 1, with the same pins

}  // namespace gpio

namespace {

/// Bits of a pin in a configuration register; 0: the register has none, or the lock does not include it.
unsigned bits_of_a_pin(std::uint32_t offset) {
    switch (offset) {
        case 0x00:
        case 0x08:
        case gpio::kPulls:
            return 2;
        case gpio::kTypes:
            return 1;
        case 0x20:
        case gpio::kHighFunctions:
            return 4;
        default:
            return 0;
    }
}

}  // namespace

Gpio::Gpio(std::uint32_t modes, std::uint32_t speeds, std::uint32_t pulls)
    : RegisterPeripheral({{0x00, modes, "MODER", kAllBits},
                          {gpio::kTypes, 0, "OTYPER", 0xFFFF},
                          {0x08, speeds, "OSPEEDR", kAllBits},
                          {gpio::kPulls, pulls, "PUPDR", kAllBits},
                          {gpio::kInput, 0, "IDR", kAllBits},
                          {gpio::kOutput, 0, "ODR", 0xFFFF},
                          {gpio::kSetReset, 0, "BSRR", kAllBits},
                          {gpio::kLock, 0, "LCKR", 0x1FFFF},
                          {0x20, 0, "AFRL", kAllBits},
                          {gpio::kHighFunctions, 0, "AFRH", kAllBits},
                          {gpio::kReset, 0, "BRR", 0xFFFF}}) {}

bool Gpio::floats(unsigned pin) const {
    return mode(pin) != Mode::output || (is_set(registers_[gpio::kTypes], pin) && is_set(registers_[gpio::kOutput], pin));
}

bool Gpio::drives_high(unsigned pin) const { return !floats(pin) && is_set(registers_[gpio::kOutput], pin); }

bool Gpio::level(unsigned pin) const {
    if (!floats(pin)) {
        return is_set(registers_[gpio::kOutput], pin);
    }
    if (mode(pin) == Mode::analog) {
        return false;  // the input stage is off
    }
    const bool pulled_up = field(registers_[gpio::kPulls], 2 * pin, 2) == 1;
    return outside_[pin] == Outside::high || (outside_[pin] == Outside::open && pulled_up);
}

void Gpio::set_outside(unsigned pin, Outside level) {
    outside_.at(pin) = level;
    on_change();
}

std::uint32_t Gpio::read(std::uint32_t offset) {
    if (offset == gpio::kLock) {
        return (registers_[gpio::kLock] & 0xFFFFU) | flag(locked_ != 0, gpio::kLockKey);
    }
    if (offset != gpio::kInput) {
        return registers_.at(offset);
    }
    std::uint32_t levels = 0;
    for (unsigned pin = 0; pin < 16; ++pin) {
        levels |= flag(level(pin), pin);
    }
    return levels;
}

/// RM0440: the key bit is written 1, 0, 1 with the same pins, then LCKR is read. After that the pins stay locked until a reset.
void Gpio::lock(std::uint32_t value) {
    fail_if(locked_ != 0, "LCKR is written while pins are locked");
    const bool key = is_set(value, gpio::kLockKey);
    const bool continues = lock_step_ > 0 && (value & 0xFFFFU) == lock_written_ && key == (lock_step_ != 1);
    lock_step_ = continues ? lock_step_ + 1 : key ? 1 : 0;
    lock_written_ = value & 0xFFFFU;
    registers_.at(gpio::kLock) = lock_written_;
    locked_ = lock_step_ == gpio::kLockSteps ? lock_written_ : 0;
}

void Gpio::check_lock(std::uint32_t offset, std::uint32_t value) const {
    const unsigned width = bits_of_a_pin(offset);
    const std::uint32_t changed = value ^ registers_[offset];
    for (unsigned bit = 0; bit < 32 && width != 0; ++bit) {
        const unsigned pin = bit / width + (offset == gpio::kHighFunctions ? 8 : 0);
        fail_if(is_set(changed, bit) && is_set(locked_, pin), "pin {} is locked (LCKR) until the next reset", pin);
    }
}

void Gpio::apply(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case gpio::kInput:
            throw RunFailure("IDR is read-only");
        case gpio::kSetReset:
            registers_.at(gpio::kOutput) = (registers_[gpio::kOutput] & ~(value >> 16U)) | (value & 0xFFFFU);
            break;
        case gpio::kReset:
            registers_.at(gpio::kOutput) &= ~value;
            break;
        case gpio::kLock:
            lock(value);
            break;
        default:
            if (locked_ != 0) {
                check_lock(offset, value);
            }
            registers_.at(offset) = value;
    }
    on_change();
}

/// RM0440: the registers of a port accept bytes, half-words and words.
void Gpio::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    const std::uint32_t word = offset & ~3U;
    const bool is_command = word == gpio::kSetReset || word == gpio::kReset;
    write(word, with_part(is_command ? 0 : registers_.at(word), offset, value, bytes));
}

void Gpio::reset() {
    registers_.reset();
    locked_ = 0;
    lock_step_ = 0;
    on_change();
}

}  // namespace tricoil::virtual_board
