#include "tests/alloc/allocation_trap.hpp"

#include <cstdlib>
#include <new>

namespace {

thread_local bool armed = false;
thread_local std::size_t allocations = 0;

void note() { allocations += armed ? 1U : 0U; }

}  // namespace

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): glibc's own names
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
// NOLINTEND(readability-identifier-naming)

// glibc lets a program replace these functions; operator new calls malloc.
void* malloc(std::size_t size) {
    note();
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    note();
    return __libc_calloc(count, size);
}
void* realloc(void* pointer, std::size_t size) {
    note();
    return __libc_realloc(pointer, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    note();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
    note();
    *pointer = __libc_memalign(alignment, size);
    return *pointer == nullptr ? 12 : 0;
}
}

namespace tricoil::test {

AllocationTrap::AllocationTrap() {
    allocations = 0;
    armed = true;
}
AllocationTrap::~AllocationTrap() { armed = false; }
std::size_t AllocationTrap::count() const { return allocations; }

}  // namespace tricoil::test
