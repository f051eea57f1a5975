#include "board/cortex_m/program.hpp"

#include <cstddef>
#include <cstdint>
#include <new>

#include "board/cortex_m/stack.hpp"

int main();

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): names of the linker script and of the ARM runtime ABI
extern std::uint32_t data_image[], data_begin[], data_end[], bss_begin[], bss_end[];
extern void (*init_array_begin[])();
extern void (*init_array_end[])();

// Functions that the compiler calls implicitly. Objects are never destroyed and nothing unwinds.
[[noreturn]] void abort() { tricoil::board::halt(); }
[[noreturn]] void __cxa_pure_virtual() { abort(); }
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
void* __dso_handle = nullptr;
void __aeabi_unwind_cpp_pr0() {}  // referenced by unwind tables in the compiler's library, which the linker script drops
void __aeabi_unwind_cpp_pr1() {}
// NOLINTEND(readability-identifier-naming)
}

namespace tricoil::board {

void initialise_memory() {
    paint_stack();
    const std::uint32_t* from = data_image;
    for (std::uint32_t* to = data_begin; to != data_end; ++to) {
        *to = *from++;
    }
    for (std::uint32_t* word = bss_begin; word != bss_end; ++word) {
        *word = 0;
    }
    for (void (**constructor)() = init_array_begin; constructor != init_array_end; ++constructor) {
        (*constructor)();
    }
}

int run_main() {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"  // the start-up code calls main
    return main();
#pragma GCC diagnostic pop
}

}  // namespace tricoil::board

// Virtual destructors refer to operator delete. It is never called, because there is no heap.
void operator delete(void*) noexcept { abort(); }
void operator delete(void*, std::size_t) noexcept { abort(); }
void operator delete(void*, std::size_t, std::align_val_t) noexcept { abort(); }
