#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {

std::int32_t call(Operation operation, const void* argument) {
    register auto r0 asm("r0") = static_cast<std::uint32_t>(operation);
    register auto r1 asm("r1") = argument;
    asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return static_cast<std::int32_t>(r0);
}

void exit(int status) {
    constexpr std::uint32_t kApplicationExit = 0x20026;
    const std::uint32_t block[2] = {kApplicationExit, static_cast<std::uint32_t>(status)};
    for (;;) {
        call(Operation::exit_extended, block);
    }
}

}  // namespace tricoil::semihosting
