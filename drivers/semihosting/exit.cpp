#include "drivers/semihosting/exit.hpp"

#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {

void exit(int status) {
    constexpr std::uint32_t kApplicationExit = 0x20026;
    const std::uint32_t block[2] = {kApplicationExit, static_cast<std::uint32_t>(status)};
    for (;;) {
        call(Operation::exit_extended, block);
    }
}

}  // namespace tricoil::semihosting
