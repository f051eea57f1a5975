// The golden cases on an emulated processor.
#include "drivers/semihosting/console.hpp"
#include "tests/golden/results.hpp"

int main() {
    tricoil::semihosting::Console console;
    bool ok = true;
    for (int n = 0; n < tricoil::golden::cases(); ++n) {
        ok = tricoil::golden::print_float(n, console).ok() && tricoil::golden::print_fixed(n, console).ok() && ok;
    }
    return ok ? 0 : 1;
}
