// Recurses until the stack is full: the analysis must report it, and the image must end with an error.
#include "board/qemu_an386/report_printer.hpp"
#include "drivers/semihosting/console.hpp"

namespace {

volatile int calls = 400;

[[gnu::noinline]] int fall(int n) {
    volatile int frame[8];
    frame[0] = n;
    return n == 0 ? 0 : fall(n - 1) + frame[0];
}

}  // namespace

int main() {
    tricoil::semihosting::Console console;
    calls = fall(calls);
    return tricoil::board::print_stack_use(console).ok() ? 0 : 1;
}
