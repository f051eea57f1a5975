// Preloaded into a program: CLOCK_REALTIME is ahead by the microseconds in the file TRICOIL_WALL_CLOCK (eight bytes, mapped), so
// that a test can step the clock of one program.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

namespace {

const volatile std::int64_t* ahead_us() {
    static const auto* const place = [] {
        const char* path = std::getenv("TRICOIL_WALL_CLOCK");
        const int file = path != nullptr ? ::open(path, O_RDONLY | O_CLOEXEC) : -1;
        void* const map = file >= 0 ? ::mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0) : MAP_FAILED;
        if (map == MAP_FAILED) {
            std::abort();
        }
        ::close(file);
        return static_cast<const volatile std::int64_t*>(map);
    }();
    return place;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
    using Function = int (*)(clockid_t, timespec*);
    static const auto real =
        reinterpret_cast<Function>(::dlsym(RTLD_NEXT, "clock_gettime"));  // NOLINT: a function as dlsym returns it
    const int status = real(clock, now);
    if (status == 0 && clock == CLOCK_REALTIME) {
        constexpr std::int64_t kSecond_us = 1'000'000;
        const std::int64_t ahead = *ahead_us();
        const std::int64_t nanoseconds = now->tv_nsec + 1000 * (ahead % kSecond_us) + 1000 * kSecond_us;
        now->tv_sec += ahead / kSecond_us - 1 + nanoseconds / (1000 * kSecond_us);
        now->tv_nsec = nanoseconds % (1000 * kSecond_us);
    }
    return status;
}
