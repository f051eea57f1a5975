// Status LED.
#pragma once

#include "core/base/time.hpp"
#include "core/protocol/message_type.hpp"
#include "hal/indicator.hpp"

namespace tricoil::app {

/// Idle: one flash per second. Running: on, with one gap per second. Fault: eight flashes per second.
inline void show(hal::Indicator& light, protocol::DeviceState state, DeviceTime now) {
    // In units of 1.05 s / 16: powers of two avoid a slow 64-bit division.
    const auto phase = static_cast<std::uint32_t>(to_us(now) >> 16) & 15U;
    const bool flash = phase == 0;
    switch (state) {
        case protocol::DeviceState::idle:
            light.show(flash);
            break;
        case protocol::DeviceState::running:
            light.show(!flash);
            break;
        case protocol::DeviceState::fault:
            light.show(phase % 2 == 0);
            break;
    }
}

}  // namespace tricoil::app
