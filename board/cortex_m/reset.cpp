#include "board/cortex_m/reset.hpp"

#include "board/cortex_m/program.hpp"

extern "C" {
[[gnu::weak]] void before_memory() {}

[[noreturn, gnu::used]] void start_program() {
    before_memory();
    tricoil::board::initialise_memory();
    tricoil::board::finish(tricoil::board::run_main());
}

/// Enables the floating-point unit before its first instruction (CPACR, ARMv7-M B3.2.20). The first write to a memory may be lost
/// (ES0430 2.2.7), so it is not that of a return address.
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
    asm volatile("push {r0}\n pop {r0}\n b start_program\n");
}
}
