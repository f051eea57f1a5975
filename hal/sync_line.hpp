// A hardware line by which the front end tells that a window is over.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil::hal {

class SyncLine {
public:
    SyncLine() = default;
    SyncLine(const SyncLine&) = delete;
    SyncLine& operator=(const SyncLine&) = delete;
    virtual ~SyncLine() = default;

    /// The oldest edge not yet told, by its time on the host's monotonic clock. Never waits.
    /// ok; not_ready: none since; device_lost.
    Status next_edge(std::int64_t& host_time_us) { return do_next_edge(host_time_us); }

    /// Waits until there is an edge, `timeout` at most. ok; timed_out; device_lost.
    Status wait(Microseconds timeout) { return do_wait(timeout); }

private:
    virtual Status do_next_edge(std::int64_t& host_time_us) = 0;
    virtual Status do_wait(Microseconds timeout) = 0;
};

}  // namespace tricoil::hal
