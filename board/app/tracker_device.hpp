// The firmware application of a tracker board: from power-on to poses on every link, commands, faults. All that it knows of time
// it has from hal::Clock and from the blocks.
#pragma once

#include "board/app/device_parts.hpp"
#include "core/protocol/message_type.hpp"

namespace tricoil::app {

/// Coils are off until a host has said start, after any fault, when the last host has stopped or fallen silent, and after
/// destruction. Memory for everything is part of the object; make it static.
class TrackerDevice {
public:
    TrackerDevice(const DeviceHardware& hardware, const DeviceParams& params);
    ~TrackerDevice();
    TrackerDevice(const TrackerDevice&) = delete;
    TrackerDevice& operator=(const TrackerDevice&) = delete;

    /// Checks the processor and itself, reads the calibration, opens the links, starts the watchdog. Once, before step().
    void boot();

    /// One turn: hears the hosts, then measures one block, or sleeps a little if nobody wants any.
    void step();

    [[nodiscard]] protocol::DeviceState state() const;
    [[nodiscard]] protocol::Faults faults() const;
};

}  // namespace tricoil::app
