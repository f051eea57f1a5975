// How a board blinks.
#pragma once

#include "core/base/time.hpp"
#include "core/protocol/message_type.hpp"
#include "hal/indicator.hpp"

namespace tricoil::app {

/// Idle: a flash a second. Running: lit, with a gap a second. Fault: eight times a second.
inline void show(hal::Indicator& light, protocol::DeviceState state, DeviceTime now) {
    constexpr std::int64_t kSecond = 1'000'000;
    constexpr std::int64_t kFlash = kSecond / 16;
    const std::int64_t phase = to_us(now) % kSecond;
    const bool flash = phase < kFlash;
    switch (state) {
        case protocol::DeviceState::idle:
            light.show(flash);
            break;
        case protocol::DeviceState::running:
            light.show(!flash);
            break;
        case protocol::DeviceState::fault:
            light.show(phase / kFlash % 2 == 0);
            break;
    }
}

}  // namespace tricoil::app
