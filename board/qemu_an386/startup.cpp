// Vectors and fault handling.
#include <cstdint>

#include "board/cortex_m/program.hpp"
#include "board/cortex_m/reset.hpp"
#include "core/base/assertion.hpp"
#include "core/base/text_line.hpp"
#include "drivers/semihosting/call.hpp"
#include "drivers/semihosting/console.hpp"

namespace {
constexpr int kExitFault = 99;  // exit status after a fault or a forbidden call
}

void tricoil::board::halt() { semihosting::exit(kExitFault); }

void tricoil::board::finish(int status) { semihosting::exit(status); }

void tricoil::assertion_failed(const char* condition, const char* file, int line) {
    TextLine text;
    text.text(file).text(":").decimal(line).text(": assertion failed: ").text(condition).text("\n");
    (void)semihosting::Console().write(text.view());
    board::halt();
}
extern "C" {
extern std::uint32_t stack_top[];  // NOLINT(readability-identifier-naming): name of the linker script

[[noreturn]] void fault_handler() { tricoil::board::halt(); }

using Handler = void (*)();

/// Stack pointer, reset and system exceptions, all unexpected; null: reserved.
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
