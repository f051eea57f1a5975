#include "tests/serve/poisoned_heap.hpp"

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

std::atomic<int> poison = -1;  // read by every thread that allocates

void* fresh(std::size_t size) {
    void* const memory = std::malloc(size == 0 ? 1 : size);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    if (const int pattern = poison; pattern >= 0) {
        std::memset(memory, pattern, size);
    }
    return memory;
}

}  // namespace

namespace tricoil::test {

void poison_fresh_memory(int pattern) { poison = pattern; }

}  // namespace tricoil::test

// Replaces operator new, because M_PERTURB of the C library does not fill small blocks that were used before.
void* operator new(std::size_t size) { return fresh(size); }
void* operator new[](std::size_t size) { return fresh(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
