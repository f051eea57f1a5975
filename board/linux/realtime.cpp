#include "board/linux/realtime.hpp"

#include <sched.h>
#include <sys/mman.h>

#include <cerrno>

namespace tricoil::linux_board {

RealtimeHabits take_realtime_habits(bool lock_memory, int priority) {
    RealtimeHabits habits;
    habits.memory_locked = lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    habits.memory_error = habits.memory_locked ? 0 : errno;
    if (priority > 0) {
        const sched_param parameter{priority};
        habits.fifo = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
        habits.fifo_error = habits.fifo ? 0 : errno;
    }
    return habits;
}

}  // namespace tricoil::linux_board
