// Heartbeat line, status LED and button.
#pragma once

#include "drivers/stm32g4/gpio.hpp"
#include "hal/heartbeat.hpp"
#include "hal/indicator.hpp"
#include "hal/push_button.hpp"

namespace tricoil::stm32g4 {

/// One edge per beat.
class HeartbeatLine final : public hal::Heartbeat {
public:
    explicit HeartbeatLine(const Pin& pin) : pin_(pin) {}

private:
    Status do_beat() override {
        level_ = !level_;
        pin_.set(level_);
        return {};
    }

    Pin pin_;
    bool level_ = false;
};

class StatusLed final : public hal::Indicator {
public:
    explicit StatusLed(const Pin& pin) : pin_(pin) {}

private:
    void do_show(bool lit) override { pin_.set(lit); }

    Pin pin_;
};

/// High while it is pressed.
class ButtonLine final : public hal::PushButton {
public:
    explicit ButtonLine(const Pin& pin) : pin_(pin) {}

private:
    [[nodiscard]] bool do_is_pressed() const override { return pin_.is_high(); }

    Pin pin_;
};

}  // namespace tricoil::stm32g4
