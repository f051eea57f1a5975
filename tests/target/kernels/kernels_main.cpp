// Runs every kernel between the two markers of the instruction counter; prints the kernel names in the same order.
#include "board/cortex_m/stack.hpp"
#include "board/qemu_an386/report_printer.hpp"
#include "core/base/text_line.hpp"
#include "drivers/semihosting/console.hpp"
#include "tests/target/kernels/kernel.hpp"

extern "C" {
// Functions that the compiler can neither inline nor remove; their addresses are the markers of the counter.
[[gnu::noinline]] void count_begin() { asm volatile("" ::: "memory"); }
[[gnu::noinline]] void count_end() {
    asm volatile("nop" ::: "memory");
}  // a different body, so that the two functions are not merged
}

namespace {

using tricoil::target::Kernel;

void nothing(int) { asm volatile("" ::: "memory"); }

/// The cost of the call alone; subtracted from every count.
const Kernel kEmpty{"empty", 1, nothing, nothing};

void measure(const Kernel& kernel, tricoil::hal::Console& console) {
    for (int run = 0; run < kernel.runs; ++run) {
        kernel.prepare(run);
        count_begin();
        kernel.run(run);
        count_end();
        tricoil::TextLine line;
        line.text("kernel ").text(kernel.name).text("\n");
        (void)console.write(line.view());
    }
}

}  // namespace

int main() {
    tricoil::semihosting::Console console;
    measure(kEmpty, console);
    for (const auto kernels : {
             tricoil::target::float_kernels(),
#if TRICOIL_FILTER_KERNELS
                 tricoil::target::filter_kernels(),
#endif
                 tricoil::target::fixed_kernels(),
         }) {
        for (const Kernel& kernel : kernels) {
            measure(kernel, console);
        }
    }
    return tricoil::board::print_stack_use(console).ok() ? 0 : 1;
}
