// One line of text in a fixed buffer, for reports on boards without heap and printf.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

namespace tricoil {

/// Appends in call order. Text beyond the capacity is dropped.
class TextLine {
public:
    static constexpr std::size_t kCapacity = 192;

    constexpr TextLine& text(std::string_view text) {
        for (const char c : text) {
            put(c);
        }
        return *this;
    }

    /// Adds blanks up to column `column`, and at least one blank.
    constexpr TextLine& pad_to(std::size_t column) {
        do {
            put(' ');
        } while (length_ < column);
        return *this;
    }

    constexpr TextLine& decimal(std::int32_t value) {
        std::array<char, 10> digits{};
        std::size_t count = 0;
        auto rest = value < 0 ? 0U - static_cast<std::uint32_t>(value) : static_cast<std::uint32_t>(value);
        do {
            digits[count++] = static_cast<char>('0' + rest % 10);
            rest /= 10;
        } while (rest != 0);
        if (value < 0) {
            put('-');
        }
        while (count > 0) {
            put(digits[--count]);
        }
        return *this;
    }

    /// "0x" and at least `width` digits.
    constexpr TextLine& hex(std::uint32_t value, int width) {
        text("0x");
        int shift = 28;
        while (shift > 0 && (value >> shift) == 0 && shift >= 4 * width) {
            shift -= 4;
        }
        for (; shift >= 0; shift -= 4) {
            put("0123456789abcdef"[(value >> shift) & 15U]);
        }
        return *this;
    }

    /// Four digits and an exponent, "-1.234e-05", or "nan", "inf". The last digit may be off by one.
    constexpr TextLine& scientific(float value) {
        if (value != value) {
            return text("nan");
        }
        if (value < 0) {
            put('-');
            value = -value;
        }
        if (value > std::numeric_limits<float>::max()) {
            return text("inf");
        }
        int exponent = 0;
        for (; value >= 10; ++exponent) {
            value /= 10;
        }
        for (; value > 0 && value < 1; --exponent) {
            value *= 10;
        }
        auto thousandths = static_cast<std::int32_t>(value * 1000 + 0.5F);
        if (thousandths >= 10'000) {  // 9.9996 rounds to 10.00
            thousandths = 1000;
            ++exponent;
        }
        put(static_cast<char>('0' + thousandths / 1000));
        put('.');
        for (std::int32_t unit = 100; unit > 0; unit /= 10) {
            put(static_cast<char>('0' + thousandths / unit % 10));
        }
        text(exponent < 0 ? "e-" : "e+");
        exponent = exponent < 0 ? -exponent : exponent;
        put(static_cast<char>('0' + exponent / 10));
        put(static_cast<char>('0' + exponent % 10));
        return *this;
    }

    [[nodiscard]] constexpr std::string_view view() const { return {characters_.data(), length_}; }

private:
    constexpr void put(char c) {
        if (length_ < kCapacity) {
            characters_[length_++] = c;
        }
    }

    std::array<char, kCapacity> characters_{};
    std::size_t length_ = 0;
};

}  // namespace tricoil
