// Modes, amplitudes and limits of this board: the parameters of its analog circuits.
#pragma once

#include <array>

#include "board/stm32g4/parameters/channels.hpp"
#include "core/signal/stated_plan.hpp"
#include "drivers/stm32g4/acquisition.hpp"

namespace tricoil::nucleo_g474re {

constexpr int kOversampling = 8;
constexpr double kSampleRateHz = stm32g4::Acquisition::sample_rate_hz(kOversampling);  // 71.79 kS/s

/// Frequency at which a sensor channel with gain 1 gives the coupling itself; the channel's response is proportional to
/// frequency.
constexpr double kUnityResponseHz = 10e3;

constexpr app::MeasuringMode with_response(const signal::AcquisitionPlan& plan) {
    return stm32g4_board::with_response(plan, kUnityResponseHz);
}

/// Modes; the first one is active after power-on. The FDM modes have the same carriers, 7.66, 9.57 and 13.40 kHz, such that no
/// third-order product of two has the frequency of the third. TDM has one carrier, 10.77 kHz. Two bands: 7.66, 10.05 and
/// 13.40 kHz and 479, 718 and 957 Hz, such that also no high carrier plus or minus two low ones has the frequency of another.
inline constexpr std::array kModes{
    with_response(signal::stated_tdm_plan(kSampleRateHz, 100, 20, 12)),                         // 239.3 frames/s
    with_response(signal::stated_fdm_plan(kSampleRateHz, 300, {32, 40, 56})),                   // 239.3
    with_response(signal::stated_fdm_plan(kSampleRateHz, 75, {8, 10, 14})),                     // 957.2
    with_response(signal::stated_tdm_plan(kSampleRateHz, 50, 10, 6)),                           // 478.6
    with_response(signal::stated_dual_band_plan(kSampleRateHz, 300, {32, 42, 56}, {2, 3, 4})),  // 239.3
};

/// Full amplitude gives 0.7 V; all FDM carriers together 1.0 V, two bands 1.2 V, because they start at phase zero.
constexpr float kMaxReference_v = 1.3F;
constexpr float kTripMargin = 1.1F;  // hardware limit / software limit: the software detects an over-current first and reports it
constexpr float kCouplingConstant = 0.12544F;  // C of coil S2 and the nominal sensor coils; a test compares it with coils.toml
/// Moments of S1 to S3 relative to S2.
constexpr std::array kMoments{0.99241F, 1.0F, 0.98853F};

app::DeviceParams device_params(std::uint64_t serial, std::uint32_t firmware);

}  // namespace tricoil::nucleo_g474re
