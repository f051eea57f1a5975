// Permission of a person at the device for one command that replaces its firmware or its calibration.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace tricoil::app {

/// A press of the button permits one command within kWindow. The level must be constant for kDebounce: contacts bounce, and the
/// coils disturb an open line. A button that is closed since power-on permits nothing until it was open.
class LocalPermission {
public:
    static constexpr Microseconds kWindow{60'000'000};
    static constexpr Microseconds kDebounce{20'000};
    static constexpr std::uint8_t kAlways = 255;

    /// Without a button everything is permitted.
    explicit LocalPermission(bool has_button) : has_button_(has_button) {}

    /// Call many times a second.
    void update(bool is_pressed, DeviceTime now) {
        if (is_pressed != level_) {
            level_ = is_pressed;
            since_ = now;
        }
        if (level_ == is_closed_ || now - since_ < kDebounce) {
            return;
        }
        is_closed_ = level_;
        if (is_closed_) {
            until_ = now + kWindow;
        }
    }

    [[nodiscard]] bool is_given(DeviceTime now) const { return !has_button_ || now < until_; }
    /// Call when the command is executed.
    void use() { until_ = {}; }

    /// Remaining time in seconds, at least 1 while the permission lasts; kAlways without a button.
    [[nodiscard]] std::uint8_t remaining_s(DeviceTime now) const {
        if (!has_button_) {
            return kAlways;
        }
        const Microseconds left = now < until_ ? until_ - now : Microseconds{0};
        return static_cast<std::uint8_t>((static_cast<std::uint32_t>(left.count()) + 999'999) / 1'000'000);
    }

private:
    bool has_button_;
    bool is_closed_ = true;  // debounced
    bool level_ = true;
    DeviceTime since_{};  // of `level_`
    DeviceTime until_{};
};

}  // namespace tricoil::app
