// UTC of poses, from their device times and arrivals.
#pragma once

#include "board/support/wall_clock.hpp"
#include "core/protocol/clock_map.hpp"

namespace tricoil::host {

class PoseUtc {
public:
    /// window_s: demodulation window. The shortest time from its midpoint to the arrival of its pose is half of it.
    void begin(double window_s) {
        map_ = {};
        lead_ = microseconds_from_seconds(window_s / 2);
    }
    /// Of a pose that has just arrived.
    UtcTime at(DeviceTime time) {
        map_.observe(time, drivers::host_now());
        return to_utc(map_.to_host(time) - lead_);
    }

private:
    protocol::ClockMap map_;
    Microseconds lead_{};
};

}  // namespace tricoil::host
