// Response and gain steps of the sensor channels with the chip's op-amps and converters.
#pragma once

#include <numbers>

#include "board/app/device_parts.hpp"
#include "drivers/stm32g4/range_steps.hpp"

namespace tricoil::stm32g4_board {

constexpr float kGainBandwidthHz = 13e6F;  // of the op-amps (DS12288)

/// A coil's voltage is the derivative of the flux, so the response is i f / f0 at carrier frequency f. unity_hz: f0, at which
/// the response of a sensor channel with gain 1 has magnitude 1.
constexpr app::MeasuringMode with_response(const signal::AcquisitionPlan& plan, double unity_hz) {
    signal::ChannelResponse<float> response{};
    for (std::size_t carrier = 0; carrier < response.size(); ++carrier) {
        const auto ratio = static_cast<float>(plan.params.carrier_hz[carrier] / unity_hz);
        for (auto& coil : response[carrier]) {
            coil = {0, ratio};
        }
    }
    return {plan, response};
}

/// Nominal values; the board measures the actual ones at boot.
inline signal::GainSteps<float> gain_steps() {
    signal::GainSteps<float> steps{};
    for (std::uint8_t n = 0; n < stm32g4::kRangeSteps; ++n) {
        const float gain = stm32g4::SensorAmplifiers::gain_of(stm32g4::amplifier_step(n));
        steps[n].drive = stm32g4::drive_of(n);
        steps[n].gain = {gain, gain, gain};
        steps[n].lag_s.fill(gain / (2 * std::numbers::pi_v<float> * kGainBandwidthHz));
    }
    return steps;
}

}  // namespace tricoil::stm32g4_board
