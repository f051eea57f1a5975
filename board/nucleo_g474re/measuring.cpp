#include "board/nucleo_g474re/measuring.hpp"

namespace tricoil::nucleo_g474re {
namespace {

/// The noise of coil and preamplifier passes the low-pass of 40 kHz and the mean of eight conversions: of its power, 0.93 is left
/// at the carriers, and 0.56 where the noise is estimated, near half the sample rate. Op-amp and converter are white.
float noise_at_carriers(float gain) {
    constexpr float kPreamplifier = 0.093F;  // codes^2 of a conversion, times the gain squared: preamplifier.noise_10769
    constexpr float kOpAmp = 0.315F;         // times the gain: 100 nV/rtHz
    constexpr float kConverter = 0.45F;      // 66 dB
    const float coloured = kPreamplifier * gain * gain;
    const float white = kOpAmp * gain + kConverter;
    return (0.93F * coloured + white) / (0.56F * coloured + white);
}

}  // namespace

app::DeviceParams device_params(std::uint64_t serial, std::uint32_t firmware) {
    app::DeviceParams params;
    params.serial = serial;
    params.firmware = firmware;
    params.modes = kModes;
    params.demodulator.gain_steps = stm32g4_board::gain_steps();
    for (signal::GainStep<float>& step : params.demodulator.gain_steps) {
        step.noise = noise_at_carriers(step.gain[0]);
    }
    params.demodulator.conversions = kOversampling;
    params.demodulator.ladder_s = stm32g4::SensorAmplifiers::kLadder_s;
    params.demodulator.sigma_floor = 1e-7F;  // quantisation at the highest gain
    params.demodulator.min_reference_v = 50e-3F;
    params.demodulator.linear_share = 0.95F;  // the op-amp output saturates 0.1 V from the rails (DS12288)
    params.coupling_constant_m3 = kCouplingConstant;
    params.moments = Vec3<float>(kMoments[0], kMoments[1], kMoments[2]);
    params.most_reference_v = kMaxReference_v;
    return params;
}

}  // namespace tricoil::nucleo_g474re
