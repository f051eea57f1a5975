#include "tests/serve/poisoned_heap.hpp"

#include <cstdlib>
#include <cstring>
#include <new>

namespace {

int poison = -1;  // set by one test at a time

void* fresh(std::size_t size) {
    void* const memory = std::malloc(size == 0 ? 1 : size);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    if (poison >= 0) {
        std::memset(memory, poison, size);
    }
    return memory;
}

}  // namespace

namespace tricoil::test {

void poison_fresh_memory(int pattern) { poison = pattern; }

}  // namespace tricoil::test

// M_PERTURB of the C library does not fill small blocks that were used before.
void* operator new(std::size_t size) { return fresh(size); }
void* operator new[](std::size_t size) { return fresh(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
