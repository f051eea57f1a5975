// Cyclic redundancy check unit (RM0440 section 16).
#pragma once

#include <algorithm>

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Crc final : public RegisterPeripheral {
public:
    Crc()
        : RegisterPeripheral({{kData, 0xFFFFFFFF, "DR", kAllBits},
                              {0x04, 0, "IDR", kAllBits},
                              {kControl, 0, "CR", 0xF9},
                              {kInitial, 0xFFFFFFFF, "INIT", kAllBits},
                              {kPolynomial, 0x04C11DB7, "POL", kAllBits}}) {}

    std::uint32_t read(std::uint32_t offset) override { return offset == kData ? result() : registers_.at(offset); }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        if (offset != kData) {
            Peripheral::write_narrow(offset, value, bytes);
        }
        feed(value, 8 * bytes);
    }
    void reset() override {
        registers_.reset();
        remainder_ = registers_[kInitial];
    }

private:
    static constexpr std::uint32_t kData = 0x00;
    static constexpr std::uint32_t kControl = 0x08;
    static constexpr std::uint32_t kInitial = 0x10;
    static constexpr std::uint32_t kPolynomial = 0x14;

    void apply(std::uint32_t offset, std::uint32_t value) override {
        switch (offset) {
            case kData:
                feed(value, 32);
                break;
            case kControl:
                registers_.at(kControl) = value & ~1U;
                remainder_ = is_set(value, 0) ? registers_[kInitial] : remainder_;
                break;
            case kInitial:
                registers_.at(kInitial) = value;
                remainder_ = value;
                break;
            default:
                registers_.at(offset) = value;
        }
    }

    [[nodiscard]] unsigned size() const {
        constexpr unsigned kSizes[] = {32, 16, 8, 7};
        return kSizes[field(registers_[kControl], 3, 2)];
    }
    /// The bits of each unit of `unit` bits in reverse order.
    static std::uint32_t reversed(std::uint32_t value, unsigned bits, unsigned unit) {
        std::uint32_t out = 0;
        for (unsigned n = 0; n < bits; ++n) {
            out |= (value >> n & 1U) << (n / unit * unit + unit - 1 - n % unit);
        }
        return out;
    }
    void feed(std::uint32_t value, unsigned bits) {
        const unsigned reversal = field(registers_[kControl], 5, 2);  // REV_IN: by byte, half-word, word
        value = reversal == 0 ? value : reversed(value, bits, std::min(4U << reversal, bits));
        const std::uint32_t top = 1U << (size() - 1);
        for (unsigned n = bits; n-- > 0;) {
            const bool carry = ((remainder_ & top) != 0) != ((value >> n & 1U) != 0);
            remainder_ = remainder_ << 1U ^ (carry ? registers_[kPolynomial] : 0U);
        }
        remainder_ &= top | (top - 1);
    }
    [[nodiscard]] std::uint32_t result() const {
        return is_set(registers_[kControl], 7) ? reversed(remainder_, size(), size()) : remainder_;
    }

    std::uint32_t remainder_ = 0xFFFFFFFF;
};

}  // namespace tricoil::virtual_board
