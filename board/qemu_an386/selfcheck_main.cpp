// Self-check of core on the emulated processor: report on the console, result as exit status.
#include "board/cortex_m/stack.hpp"
#include "board/qemu_an386/report_printer.hpp"
#include "core/selfcheck/selfcheck.hpp"
#include "drivers/semihosting/clock.hpp"
#include "drivers/semihosting/console.hpp"

namespace {

tricoil::DeviceTime now(const void* clock) { return static_cast<const tricoil::hal::Clock*>(clock)->now(); }

tricoil::selfcheck::Report report;  // static, to save 2 KiB of stack

}  // namespace

int main() {
    tricoil::semihosting::Console console;
    const tricoil::semihosting::Clock clock;
    report = tricoil::selfcheck::run({&now, static_cast<const tricoil::hal::Clock*>(&clock)});
    const bool printed = tricoil::board::print(report, console).ok();
    const bool counted = tricoil::board::print_stack_use(console).ok();
    return report.passed() && printed && counted ? 0 : 1;
}
