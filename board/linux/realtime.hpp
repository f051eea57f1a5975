// Real-time settings of the kernel for the main loop.
#pragma once

namespace tricoil::linux_board {

struct RealtimeStatus {
    bool memory_locked = false;  // mlockall: no page faults in the loop
    bool fifo = false;           // SCHED_FIFO at the requested priority
    int memory_error = 0;        // errno of a refused request; 0: none
    int fifo_error = 0;
};

/// Requests the settings and returns the granted ones. A refusal is not an error. `priority` 0: does not change the scheduling.
RealtimeStatus request_realtime(bool lock_memory, int priority);

}  // namespace tricoil::linux_board
