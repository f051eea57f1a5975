// Heartbeat line to the hardware enable.
#pragma once

#include "drivers/gpiod/gpio_lines.hpp"
#include "hal/heartbeat.hpp"

namespace tricoil::drivers {

/// Each beat toggles the line. The destructor sets it low and releases it.
class GpioHeartbeat final : public hal::Heartbeat {
public:
    GpioHeartbeat() = default;
    ~GpioHeartbeat() override { (void)line_.set(0, false); }
    Status open(const GpioLineName& line, Text& reason) { return line_.request({line}, reason); }

private:
    Status do_beat() override {
        level_ = !level_;
        return line_.set(0, level_);
    }

    GpioOutputs line_;
    bool level_ = false;
};

}  // namespace tricoil::drivers
