// Column messages of a front end, for tests of receivers.
#pragma once

#include "core/protocol/messages.hpp"

namespace tricoil::test {

/// Column n of coil `coil` (1-3) that echoes `state_sequence`. Windows are 1/720 s apart.
inline protocol::ColumnMessage column_message(std::uint32_t n, int coil, std::uint32_t state_sequence) {
    protocol::ColumnMessage m;
    m.sequence = n;
    m.time_us = 1389 * (static_cast<std::int64_t>(n) + 1);
    m.state = static_cast<std::uint8_t>(coil);
    m.state_sequence = state_sequence;
    m.sigma = {1e-6F, 1e-6F, 1e-6F};
    return m;
}

}  // namespace tricoil::test
