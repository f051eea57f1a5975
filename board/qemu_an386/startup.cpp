// From reset to main, and what happens instead of continuing when something is badly wrong. No C runtime start-up files are
// linked: nothing here or below knows of a heap.
#include <cstddef>
#include <cstdint>

#include "board/qemu_an386/stack.hpp"
#include "drivers/semihosting/exit.hpp"

int main();

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): names of the linker script and of the ARM runtime ABI
extern std::uint32_t data_image[], data_begin[], data_end[], bss_begin[], bss_end[];
extern std::uint32_t stack_top[];
extern void (*init_array_begin[])();
extern void (*init_array_end[])();

[[noreturn, gnu::used]] void start_program() {
    tricoil::board::paint_stack();
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
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"  // nothing but the start-up code may call main
    tricoil::semihosting::exit(main());
#pragma GCC diagnostic pop
}

/// Switches the floating-point unit on before any instruction of it can run (CPACR, ARMv7-M B3.2.20).
[[noreturn, gnu::naked]] void reset_handler() {
#ifdef __ARM_FP
    asm volatile(
        "ldr r0, =0xE000ED88\n"
        "ldr r1, [r0]\n"
        "orr r1, r1, #0xF00000\n"
        "str r1, [r0]\n"
        "dsb\n"
        "isb\n");
#endif
    asm volatile("b start_program\n");
}

[[noreturn]] void fault_handler() { tricoil::semihosting::exit(tricoil::board::kExitFault); }

// What a compiler may call without being asked. Objects are never destroyed and nothing unwinds.
[[noreturn]] void abort() { tricoil::semihosting::exit(tricoil::board::kExitFault); }
[[noreturn]] void __cxa_pure_virtual() { abort(); }
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
void* __dso_handle = nullptr;
void __aeabi_unwind_cpp_pr0() {}  // named by tables in the compiler's own library, which the linker script drops
void __aeabi_unwind_cpp_pr1() {}
// NOLINTEND(readability-identifier-naming)

using Handler = void (*)();

/// Stack pointer, reset, and the fourteen system exceptions: none is expected.
[[gnu::section(".vectors"), gnu::used]] const Handler kVectors[16] = {
    reinterpret_cast<Handler>(stack_top),
    reset_handler,
    fault_handler,
    fault_handler,
    fault_handler,
    fault_handler,
    fault_handler,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    fault_handler,
    fault_handler,
    nullptr,
    fault_handler,
    fault_handler,
};
}

// Virtual destructors name it, and nothing may ever call it: there is no heap to give back to.
void operator delete(void*) noexcept { abort(); }
void operator delete(void*, std::size_t) noexcept { abort(); }
