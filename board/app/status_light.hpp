// How a board blinks.
#pragma once

#include "core/base/time.hpp"
#include "core/protocol/message_type.hpp"
#include "hal/indicator.hpp"

namespace tricoil::app {

/// Idle: a flash a second. Running: lit, with a gap a second. Fault: eight times a second.
inline void show(hal::Indicator& light, protocol::DeviceState state, DeviceTime now) {
    // In sixteenths of 1.05 s: powers of two, as a small processor divides 64-bit numbers slowly and at length.
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
