// Bounded wait for hardware.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"

namespace tricoil::stm32g4 {

/// Calls `ready()` at most `limit` times. Thread context. ok; timed_out, with `what` as its message.
template <typename Predicate>
Status wait_until(Predicate ready, std::uint32_t limit, const char* what) {
    for (std::uint32_t i = 0; i < limit; ++i) {
        if (ready()) {
            return {};
        }
    }
    return {StatusCode::timed_out, what};
}

}  // namespace tricoil::stm32g4
