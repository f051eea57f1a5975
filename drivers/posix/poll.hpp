// Waits for one file descriptor.
#pragma once

#include <poll.h>

#include <algorithm>
#include <cerrno>

#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil::drivers {

/// Waits until `fd` is readable or has an error. ok; timed_out, also after a signal; device_lost: poll failed.
inline Status wait_readable(int fd, Microseconds timeout) {
    const std::int64_t us = std::max<std::int64_t>(timeout.count(), 0);
    const timespec limit{us / 1'000'000, us % 1'000'000 * 1000};
    pollfd poll{fd, POLLIN, 0};
    const int ready = ::ppoll(&poll, 1, &limit, nullptr);
    if (ready < 0 && errno != EINTR) {
        return {StatusCode::device_lost, "waiting failed"};
    }
    return ready > 0 ? Status{} : Status{StatusCode::timed_out, "no data"};
}

}  // namespace tricoil::drivers
