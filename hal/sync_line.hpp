// Hardware line on which the front end signals the end of a window.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil::hal {

class SyncLine : public Interface {
public:
    /// Returns the time of the oldest unread edge, on the host's monotonic clock. Never waits. ok; not_ready: no new edge;
    /// device_lost.
    Status next_edge(HostTime& edge) { return do_next_edge(edge); }

    /// Waits for an edge, at most for `timeout`. ok; timed_out; device_lost.
    Status wait(Microseconds timeout) { return do_wait(timeout); }

private:
    virtual Status do_next_edge(HostTime& edge) = 0;
    virtual Status do_wait(Microseconds timeout) = 0;
};

}  // namespace tricoil::hal
