// What this board measures with: modes, amplitudes, gains; the numbers of its analog side (README.md, "Signals").
#pragma once

#include <array>

#include "board/stm32g4/channels.hpp"
#include "core/signal/stated_plan.hpp"
#include "drivers/stm32g4/acquisition.hpp"

namespace tricoil::nucleo_g474re {

constexpr int kOversampling = 8;
constexpr double kSampleRateHz = stm32g4::Acquisition::sample_rate_hz(kOversampling);  // 72.03 kS/s

/// Where a sensor channel at gain 1 gives what the coupling says; it grows with frequency.
constexpr double kUnityResponseHz = 10e3;

constexpr app::MeasuringMode with_response(const signal::AcquisitionPlan& plan) {
    return stm32g4_board::with_response(plan, kUnityResponseHz);
}

/// The modes, the first one at power-on. The FDM modes have the same carriers, 7.68, 9.60 and 13.45 kHz: no third-order product
/// of two falls on the third. TDM has one, 10.81 kHz.
inline constexpr std::array kModes{
    with_response(signal::stated_tdm_plan(kSampleRateHz, 100, 20, 12)),        // 240.1 frames/s
    with_response(signal::stated_fdm_plan(kSampleRateHz, 300, {32, 40, 56})),  // 240.1
    with_response(signal::stated_fdm_plan(kSampleRateHz, 75, {8, 10, 14})),    // 960.5
    with_response(signal::stated_tdm_plan(kSampleRateHz, 50, 10, 6)),          // 480.2
};

constexpr float kMostReference_v = 1.3F;       // 0.7 V is what the full amplitude makes, 1.1 V the three of FDM together
constexpr float kTripMargin = 1.1F;            // of the hardware's limit, so that the program has seen why by then
constexpr float kCouplingConstant = 6.75e-3F;  // C: 0.175 V at 0.3 m

app::DeviceParams device_params(std::uint64_t serial, std::uint32_t firmware);

}  // namespace tricoil::nucleo_g474re
