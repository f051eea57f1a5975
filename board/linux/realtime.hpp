// What a loop that must not be late asks of the kernel.
#pragma once

namespace tricoil::linux_board {

struct RealtimeHabits {
    bool memory_locked = false;  // mlockall: no page is fetched in the loop
    bool fifo = false;           // SCHED_FIFO at the priority asked for
    int memory_error = 0;        // errno of what was refused
    int fifo_error = 0;
};

/// Asks, and says what was granted; a refusal is no error. `priority` 0: leave the scheduling as it is.
RealtimeHabits take_realtime_habits(bool lock_memory, int priority);

}  // namespace tricoil::linux_board
