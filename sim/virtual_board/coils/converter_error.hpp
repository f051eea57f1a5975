// Errors of one successive-approximation converter of the chip.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace tricoil::virtual_board {

class ConverterError {
public:
    static constexpr int kCodes = 4096;

    /// An ideal converter.
    ConverterError() = default;
    /// Offset within 2 LSB, gain within 0.1 %, and integral non-linearity of at most 1 LSB (typical figures of DS12288 after the
    /// chip's own calibration). The capacitors of the bits deviate at random, in proportion to the root of their size.
    explicit ConverterError(std::mt19937_64& random) {
        constexpr double kOffset = 2;
        constexpr double kGain = 1e-3;
        constexpr double kLargest = 1;
        std::uniform_real_distribution<double> unit(-1, 1);
        std::normal_distribution<double> normal(0, 1);
        offset_ = kOffset * unit(random);
        gain_ = 1 + kGain * unit(random);
        std::array<double, kBits> deviation{};
        double sum = 0;
        for (int bit = 0; bit < kBits; ++bit) {
            deviation[static_cast<std::size_t>(bit)] = normal(random) * std::sqrt(std::ldexp(1.0, bit));
            sum += deviation[static_cast<std::size_t>(bit)];
        }
        std::array<double, kCodes> errors{};
        double largest = 0;
        for (int code = 0; code < kCodes; ++code) {
            double& error = errors[static_cast<std::size_t>(code)];
            error = -sum * code / (kCodes - 1);  // from the line through both ends
            for (int bit = 0; bit < kBits; ++bit) {
                error += (code >> bit & 1) != 0 ? deviation[static_cast<std::size_t>(bit)] : 0;
            }
            largest = std::max(largest, std::abs(error));
        }
        std::transform(errors.begin(), errors.end(), error_.begin(),
                       [&](double error) { return static_cast<float>(kLargest * error / largest); });
    }

    /// Code before rounding for an ideal code.
    [[nodiscard]] double code(double ideal) const {
        const double place = std::clamp(ideal, 0.0, kCodes - 1.001);
        const auto below = static_cast<std::size_t>(place);
        const double part = place - static_cast<double>(below);
        const double error = (1 - part) * double{error_[below]} + part * double{error_[below + 1]};
        constexpr double kMiddle = 0.5 * kCodes;
        return kMiddle + gain_ * (ideal - kMiddle) + offset_ + error;
    }

private:
    static constexpr int kBits = 12;

    double offset_ = 0;
    double gain_ = 1;
    std::array<float, kCodes> error_{};
};

}  // namespace tricoil::virtual_board
