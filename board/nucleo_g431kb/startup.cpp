// Vector table, halt() and finish(). This board has no power stages to switch off.
#include "board/cortex_m/program.hpp"
#include "board/cortex_m/vectors.hpp"

void tricoil::board::halt() {
    for (;;) {
        asm volatile("wfi");
    }
}

void tricoil::board::finish(int) { halt(); }

extern "C" {
void fault_handler() { tricoil::board::halt(); }

[[gnu::section(".vectors"), gnu::used]] constinit const tricoil::board::Vectors<102> kVectors =
    tricoil::board::make_vectors<102>(fault_handler);
}
