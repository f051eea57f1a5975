#include "board/linux/realtime.hpp"

#include <sched.h>
#include <sys/mman.h>

namespace tricoil::linux_board {

RealtimeHabits take_realtime_habits(bool lock_memory, int priority) {
    RealtimeHabits habits;
    habits.memory_locked = lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (priority > 0) {
        const sched_param parameter{priority};
        habits.fifo = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
    }
    return habits;
}

}  // namespace tricoil::linux_board
