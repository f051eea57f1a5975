// Heartbeat line to the hardware enable, and sync line from the front end.
#pragma once

#include "drivers/gpiod/gpio_lines.hpp"
#include "hal/heartbeat.hpp"
#include "hal/sync_line.hpp"

namespace tricoil::drivers {

/// Each beat toggles the line. The destructor sets it low and releases it.
class GpioHeartbeat final : public hal::Heartbeat {
public:
    GpioHeartbeat() = default;
    ~GpioHeartbeat() override { (void)line_.set(0, false); }
    Status open(const GpioLineName& line, Text& why) { return line_.request({line}, why); }

private:
    Status do_beat() override {
        level_ = !level_;
        return line_.set(0, level_);
    }

    GpioOutputs line_;
    bool level_ = false;
};

class GpioSyncLine final : public hal::SyncLine {
public:
    Status open(const GpioLineName& line, Text& why) { return edges_.request(line, why); }

private:
    Status do_next_edge(HostTime& edge) override { return edges_.next(edge); }
    Status do_wait(Microseconds timeout) override { return edges_.wait(timeout); }

    GpioEdges edges_;
};

}  // namespace tricoil::drivers
