// Hardware interfaces and parameters of the firmware application of a tracker board.
#pragma once

#include <cstdint>
#include <span>

#include "core/calibration/blob.hpp"
#include "core/protocol/schema.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/demodulator.hpp"
#include "hal/board_monitor.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"
#include "hal/heartbeat.hpp"
#include "hal/image_bank.hpp"
#include "hal/indicator.hpp"
#include "hal/message_port.hpp"
#include "hal/push_button.hpp"
#include "hal/storage.hpp"
#include "hal/system_control.hpp"
#include "hal/watchdog.hpp"

namespace tricoil::app {

/// All must outlive the application, which uses them exclusively.
struct DeviceHardware {
    hal::Clock& clock;
    hal::CoilDriver& coils;
    hal::CoilSampler& sampler;
    hal::GainControl& gain;
    hal::Heartbeat& heartbeat;  // of the hardware enable of the power stages; toggled while coils are on
    hal::Storage& storage;      // four slots of at least CalibrationStore::kRecordBytes
    hal::ImageBank& image;
    hal::Watchdog& watchdog;
    hal::SystemControl& system;
    hal::Indicator& indicator;
    hal::PushButton& button;
    hal::BoardMonitor& monitor;
    std::span<hal::MessagePort* const> ports;  // at most kMaxPorts; each must carry messages of kMaxBoardMessage bytes
};

constexpr std::size_t kMaxPorts = 4;
/// Longest message that the application sends or receives: a calibration, or a part of a raw block.
constexpr std::size_t kMaxBoardMessage = 616;
static_assert(kMaxBoardMessage >= protocol::kFixedBytes<protocol::CalibrationMessage> + calibration::kMaxBlobBytes);

/// One mode: plan from plan_acquisition(), and channel responses at its carriers.
struct MeasuringMode {
    signal::AcquisitionPlan plan;
    signal::ChannelResponse<float> response;
};

struct DeviceParams {
    std::uint64_t serial = 0;    // unique number of the processor
    std::uint32_t firmware = 0;  // major << 16, minor << 8, patch

    /// Modes of the board; the first one is active after power-on.
    std::span<const MeasuringMode> modes{};
    /// Gain steps, noise floor, minimum reference. The responses come from the mode.
    signal::DemodulatorParams<float> demodulator;
    float coupling_constant_m3 = 0;                 // C, if there is no calibration
    Vec3<float> moments = Vec3<float>::Ones();      // of the source coils, if there is no calibration; relative
    Vec3<float> hemisphere = Vec3<float>::UnitX();  // hemisphere at power-on

    /// Limit of the reference channel's amplitude, V; above it a power stage is defective. It is half of the peak-to-peak value
    /// of the sum of all carriers.
    float most_reference_v = 0;
    /// Time without a command after which a host counts as gone. Without hosts the coils are off. Zero: no limit.
    Microseconds host_silence{250'000};
    Microseconds watchdog{500'000};
    /// False only for simulated devices: their monitor measures nothing.
    bool has_monitor = true;
    /// False only for simulated devices: loader and calibration commands need a press of the button.
    bool needs_permission = true;
};

}  // namespace tricoil::app
