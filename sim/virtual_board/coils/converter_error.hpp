// Errors of one successive-approximation converter of the chip.
#pragma once

#include <array>
#include <random>

namespace tricoil::virtual_board {

class ConverterError {
public:
    static constexpr int kCodes = 4096;

    /// An ideal converter.
    ConverterError() = default;
    /// Offset within 2 LSB, gain within 0.1 %, and integral non-linearity of at most 1 LSB (typical figures of DS12288 after the
    /// chip's own calibration). The capacitors of the bits deviate at random, in proportion to the root of their size.
    explicit ConverterError(std::mt19937_64& random);

    /// Code before rounding for an ideal code.
    [[nodiscard]] double code(double ideal) const;

private:
    static constexpr int kBits = 12;

    double offset_ = 0;
    double gain_ = 1;
    std::array<float, kCodes> error_{};
};

}  // namespace tricoil::virtual_board
