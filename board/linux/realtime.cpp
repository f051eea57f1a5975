#include "board/linux/realtime.hpp"

#include <sched.h>
#include <sys/mman.h>

#include <cerrno>

namespace tricoil::linux_board {

RealtimeStatus request_realtime(bool lock_memory, int priority) {
    RealtimeStatus realtime;
    realtime.memory_locked = lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    realtime.memory_error = realtime.memory_locked ? 0 : errno;
    if (priority > 0) {
        const sched_param parameter{priority};
        realtime.fifo = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
        realtime.fifo_error = realtime.fifo ? 0 : errno;
    }
    return realtime;
}

}  // namespace tricoil::linux_board
