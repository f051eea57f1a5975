// Preloaded into a program: makes one allocation fail, once.
//
// TRICOIL_ALLOCATION_FAULT=COUNT: the COUNT-th (from 1) malloc, calloc or realloc after the begin of main() returns null. Without
// it none fails. TRICOIL_ALLOCATION_COUNT=FILE: writes the number of allocations to FILE at the end.
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

// The allocator of the C library, under its other names.
extern "C" {
void* __libc_malloc(std::size_t size);                     // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t count, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* old, std::size_t size);         // NOLINT(bugprone-reserved-identifier)
}

namespace {

using Main = int (*)(int, char**, char**);

std::atomic<bool> has_begun = false;  // NOLINT: state of the process
std::atomic<long> seen = 0;           // NOLINT
long failing = 0;                     // NOLINT: 0: none
Main real_main = nullptr;             // NOLINT

bool fails() {
    if (!has_begun.load(std::memory_order_relaxed) || ++seen != failing) {
        return false;
    }
    errno = ENOMEM;
    return true;
}

int counted_main(int count, char** arguments, char** environment) {
    const char* number = std::getenv("TRICOIL_ALLOCATION_FAULT");
    failing = number != nullptr ? std::atol(number) : 0;
    has_begun = true;
    return real_main(count, arguments, environment);
}

void write_count() {
    const char* path = std::getenv("TRICOIL_ALLOCATION_COUNT");
    if (path == nullptr) {
        return;
    }
    std::array<char, 32> text{};
    const int size = std::snprintf(text.data(), text.size(), "%ld\n", seen.load());
    const int file = ::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (file >= 0) {
        (void)!::write(file, text.data(), static_cast<std::size_t>(size));
        ::close(file);
    }
}

__attribute__((destructor)) void end() { write_count(); }

}  // namespace

extern "C" {

void* malloc(std::size_t size) { return fails() ? nullptr : __libc_malloc(size); }

void* calloc(std::size_t count, std::size_t size) { return fails() ? nullptr : __libc_calloc(count, size); }

void* realloc(void* old, std::size_t size) { return fails() ? nullptr : __libc_realloc(old, size); }

// NOLINTNEXTLINE(bugprone-reserved-identifier): the C library's name
int __libc_start_main(Main main, int count, char** arguments, void (*init)(), void (*fini)(), void (*rtld_fini)(),
                      void* stack_end) {
    real_main = main;
    using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
    const auto start = reinterpret_cast<Start>(::dlsym(RTLD_NEXT, "__libc_start_main"));  // NOLINT: dlsym returns void*
    return start(counted_main, count, arguments, init, fini, rtld_fini, stack_end);
}
}
