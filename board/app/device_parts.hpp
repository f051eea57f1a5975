// What a tracker board puts behind the firmware application, and what it says about itself.
#pragma once

#include <cstdint>
#include <span>

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/demodulator.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"
#include "hal/heartbeat.hpp"
#include "hal/indicator.hpp"
#include "hal/message_port.hpp"
#include "hal/storage.hpp"
#include "hal/system_control.hpp"
#include "hal/watchdog.hpp"

namespace tricoil::app {

/// All must outlive the application, which has them to itself.
struct DeviceHardware {
    hal::Clock& clock;
    hal::CoilDriver& coils;
    hal::CoilSampler& sampler;
    hal::GainControl& gain;
    hal::Heartbeat& heartbeat;  // of the power stages' enable: beats while coils are on
    hal::Storage& storage;      // two slots at least, of kStoreBytes at least
    hal::Watchdog& watchdog;
    hal::SystemControl& system;
    hal::Indicator& indicator;
    std::span<hal::MessagePort* const> ports;  // at most kMaxPorts; messages of kMaxBoardMessage bytes go through whole
};

constexpr std::size_t kMaxPorts = 4;
/// Longest message that the application sends or takes: a calibration, or a part of a raw block.
constexpr std::size_t kMaxBoardMessage = 528;

/// One way to measure: how, as plan_acquisition() makes it, and what the channels make of a coupling at its carriers.
struct MeasuringMode {
    signal::AcquisitionPlan plan;
    signal::ChannelResponse<float> response;
};

struct DeviceParams {
    std::uint64_t serial = 0;    // of the processor's unique number
    std::uint32_t firmware = 0;  // major << 16, minor << 8, patch

    /// What the board can measure with; the first one at power-on.
    std::span<const MeasuringMode> modes{};
    /// Gain steps, noise floor, least reference; the responses are the mode's.
    signal::DemodulatorParams<float> demodulator;
    float coupling_constant_m3 = 0;                 // C, while there is no calibration
    Vec3<float> hemisphere = Vec3<float>::UnitX();  // where the sensor is at power-on

    /// Amplitude of the reference channel beyond which a power stage is broken; V. In FDM: of the sum of three.
    float most_reference_v = 0;
    /// Silence of a host after which it counts as gone; with the last one the coils go off. Zero: never.
    Microseconds host_silence{250'000};
    Microseconds watchdog{500'000};
};

}  // namespace tricoil::app
