// From reset to main, and what happens instead of continuing when something is badly wrong.
#include <cstdint>

#include "board/cortex_m/program.hpp"
#include "drivers/semihosting/exit.hpp"

namespace {
constexpr int kExitFault = 99;  // of an image that met a fault or called what must not be called
}

void tricoil::board::halt() { semihosting::exit(kExitFault); }

extern "C" {
extern std::uint32_t stack_top[];  // NOLINT(readability-identifier-naming): name of the linker script

[[noreturn, gnu::used]] void start_program() {
    tricoil::board::initialise_memory();
    tricoil::semihosting::exit(tricoil::board::run_main());
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

[[noreturn]] void fault_handler() { tricoil::board::halt(); }

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
