// One GPIO port (RM0440 section 9).
#pragma once

#include <array>
#include <functional>

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Gpio final : public RegisterPeripheral {
public:
    /// Ports A and B have different reset values, because some of their pins are debug pins.
    Gpio(std::uint32_t modes, std::uint32_t speeds, std::uint32_t pulls)
        : RegisterPeripheral({{0x00, modes, "MODER", kAllBits},
                              {kTypes, 0, "OTYPER", 0xFFFF},
                              {0x08, speeds, "OSPEEDR", kAllBits},
                              {kPulls, pulls, "PUPDR", kAllBits},
                              {kInput, 0, "IDR", kAllBits},
                              {kOutput, 0, "ODR", 0xFFFF},
                              {kSetReset, 0, "BSRR", kAllBits},
                              {kLock, 0, "LCKR", 0x1FFFF},
                              {0x20, 0, "AFRL", kAllBits},
                              {kHighFunctions, 0, "AFRH", kAllBits},
                              {kReset, 0, "BRR", 0xFFFF}}) {}

    enum class Mode : std::uint8_t { input, output, alternate, analog };
    [[nodiscard]] Mode mode(unsigned pin) const { return static_cast<Mode>(field(registers_[0x00], 2 * pin, 2)); }
    [[nodiscard]] unsigned function(unsigned pin) const { return field(registers_[pin < 8 ? 0x20 : 0x24], 4 * (pin % 8), 4); }
    [[nodiscard]] bool is_alternate(unsigned pin, unsigned f) const { return mode(pin) == Mode::alternate && function(pin) == f; }
    [[nodiscard]] bool is_analog(unsigned pin) const { return mode(pin) == Mode::analog; }
    /// True if the pin is an output at high level. The board's pull-downs make any other pin low.
    [[nodiscard]] bool drives_high(unsigned pin) const { return !floats(pin) && is_set(registers_[kOutput], pin); }
    /// Level that IDR shows: of an output, else of the board's circuit, else of the pull resistors.
    [[nodiscard]] bool level(unsigned pin) const {
        if (!floats(pin)) {
            return is_set(registers_[kOutput], pin);
        }
        if (mode(pin) == Mode::analog) {
            return false;  // the input stage is off
        }
        const bool pulled_up = field(registers_[kPulls], 2 * pin, 2) == 1;
        return outside_[pin] == Outside::high || (outside_[pin] == Outside::open && pulled_up);
    }

    /// Level that the board's circuit, for example a button, gives the pin.
    enum class Outside : std::uint8_t { open, low, high };
    void set_outside(unsigned pin, Outside level) {
        outside_.at(pin) = level;
        on_change();
    }
    [[nodiscard]] bool outside_is_high(unsigned pin) const { return outside_[pin] == Outside::high; }

    /// Called after the level of a pin may have changed.
    std::function<void()> on_change = [] {};

    std::uint32_t read(std::uint32_t offset) override {
        if (offset == kLock) {
            return (registers_[kLock] & 0xFFFFU) | flag(locked_ != 0, kLockKey);
        }
        if (offset != kInput) {
            return registers_.at(offset);
        }
        std::uint32_t levels = 0;
        for (unsigned pin = 0; pin < 16; ++pin) {
            levels |= flag(level(pin), pin);
        }
        return levels;
    }
    /// RM0440: the registers of a port accept bytes, half-words and words.
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        const std::uint32_t word = offset & ~3U;
        const bool is_command = word == kSetReset || word == kReset;
        write(word, with_part(is_command ? 0 : registers_.at(word), offset, value, bytes));
    }
    void reset() override {
        registers_.reset();
        locked_ = 0;
        lock_step_ = 0;
        on_change();
    }

private:
    static constexpr std::uint32_t kTypes = 0x04;
    static constexpr std::uint32_t kPulls = 0x0C;
    static constexpr std::uint32_t kInput = 0x10;
    static constexpr std::uint32_t kOutput = 0x14;
    static constexpr std::uint32_t kSetReset = 0x18;
    static constexpr std::uint32_t kLock = 0x1C;
    static constexpr std::uint32_t kHighFunctions = 0x24;
    static constexpr std::uint32_t kReset = 0x28;
    static constexpr unsigned kLockKey = 16;
    static constexpr unsigned kLockSteps = 3;  // writes of the key: 1, 0, 1, with the same pins
    /// Bits of a pin in each configuration register; 0: the lock does not include the register.
    static constexpr std::array<unsigned, 11> kBitsOfAPin{2, 1, 2, 2, 0, 0, 0, 0, 4, 4, 0};

    void apply(std::uint32_t offset, std::uint32_t value) override {
        switch (offset) {
            case kInput:
                throw RunFailure("IDR is read-only");
            case kSetReset:
                registers_.at(kOutput) = (registers_[kOutput] & ~(value >> 16U)) | (value & 0xFFFFU);
                break;
            case kReset:
                registers_.at(kOutput) &= ~value;
                break;
            case kLock:
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
    /// RM0440: the key bit is written 1, 0, 1 with the same pins, then LCKR is read. After that the pins stay locked until a
    /// reset.
    void lock(std::uint32_t value) {
        fail_if(locked_ != 0, "LCKR is written while pins are locked");
        const bool key = is_set(value, kLockKey);
        const bool continues = lock_step_ > 0 && (value & 0xFFFFU) == lock_written_ && key == (lock_step_ != 1);
        lock_step_ = continues ? lock_step_ + 1 : key ? 1 : 0;
        lock_written_ = value & 0xFFFFU;
        registers_.at(kLock) = lock_written_;
        locked_ = lock_step_ == kLockSteps ? lock_written_ : 0;
    }
    void check_lock(std::uint32_t offset, std::uint32_t value) const {
        const unsigned width = kBitsOfAPin.at(offset / 4);
        const std::uint32_t changed = value ^ registers_[offset];
        for (unsigned bit = 0; bit < 32 && width != 0; ++bit) {
            const unsigned pin = bit / width + (offset == kHighFunctions ? 8 : 0);
            fail_if(is_set(changed, bit) && is_set(locked_, pin), "pin {} is locked (LCKR) until the next reset", pin);
        }
    }
    [[nodiscard]] bool floats(unsigned pin) const {
        return mode(pin) != Mode::output || (is_set(registers_[kTypes], pin) && is_set(registers_[kOutput], pin));
    }

    std::array<Outside, 16> outside_{};
    std::uint32_t locked_ = 0;
    std::uint32_t lock_written_ = 0;  // last value of LCKR
    unsigned lock_step_ = 0;          // of the lock key sequence
};

}  // namespace tricoil::virtual_board
