// Runs every kernel between two markers that the instruction counter knows, and prints the names in the same order.
#include "board/cortex_m/stack.hpp"
#include "board/qemu_an386/report_printer.hpp"
#include "core/base/text_line.hpp"
#include "drivers/semihosting/console.hpp"
#include "tests/target/kernels/kernel.hpp"

extern "C" {
// Calls that the compiler can neither inline nor leave out; their addresses are the counter's markers.
[[gnu::noinline]] void count_begin() { asm volatile("" ::: "memory"); }
[[gnu::noinline]] void count_end() { asm volatile("nop" ::: "memory"); }  // not the same body: it would be folded into one
}

namespace {

using tricoil::target::Kernel;

void nothing(int) { asm volatile("" ::: "memory"); }

/// What calling a kernel costs by itself; subtracted from every count.
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
    for (const auto kernels :
         {tricoil::target::float_kernels(), tricoil::target::filter_kernels(), tricoil::target::fixed_kernels()}) {
        for (const Kernel& kernel : kernels) {
            measure(kernel, console);
        }
    }
    return tricoil::board::print_stack_use(console).ok() ? 0 : 1;
}
