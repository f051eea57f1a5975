#include "sim/virtual_board/coils/sensor_amplifier.hpp"

#include <gtest/gtest.h>

#include <complex>
#include <random>

namespace tricoil::virtual_board {
namespace {

constexpr double kStepS = 296 / 170e6;  // from conversion to conversion
constexpr int kWindow = 2400;           // conversions of one FDM block
constexpr int kFilling = 60 * kWindow;  // 25 time constants of the capacitor
constexpr int kSettling = 2 * kWindow;

/// Amplitude of the output for an input amplitude of 1 mV with `cycles` in a window, relative to the input.
double response(SensorAmplifier amplifier, double nominal, int cycles) {
    constexpr double kInputV = 1e-3;
    const double turn = 2 * std::numbers::pi * cycles / kWindow;
    std::complex<double> sum;
    for (int n = 0; n < kFilling; ++n) {
        amplifier.follow(0, 2, kStepS);  // the output is at its rail if a higher gain meets the empty capacitor
    }
    for (int n = 0; n < kSettling + kWindow; ++n) {
        amplifier.follow(kInputV * std::cos(turn * n), nominal, kStepS);
        sum += n < kSettling ? 0.0 : amplifier.output_v() * std::polar(2.0 / kWindow, -turn * n);
    }
    return std::abs(sum) / kInputV;
}

TEST(SensorAmplifier, HasTheResponseOfOnePoleAtEachGainAndCarrier) {
    std::mt19937_64 random(3);
    const SensorAmplifier amplifier(random);
    for (const double nominal : {1, 2, 4, 8, 16, 32, 64}) {
        for (const int cycles : {32, 40, 56}) {
            const double hz = cycles / (kWindow * kStepS);
            const double expected = amplifier.gain(nominal) / std::hypot(1, hz * nominal / amplifier.bandwidth_hz);
            EXPECT_NEAR(response(amplifier, nominal, cycles) / expected, 1, 3e-5) << "gain " << nominal << ", " << hz << " Hz";
        }
    }
}

}  // namespace
}  // namespace tricoil::virtual_board
