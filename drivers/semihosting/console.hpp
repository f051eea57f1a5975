// Console on the host's terminal.
#pragma once

#include <cstdint>

#include "hal/console.hpp"

namespace tricoil::semihosting {

class Console final : public hal::Console {
public:
    Console();

private:
    Status do_write(std::string_view text) override;

    std::int32_t handle_;
};

}  // namespace tricoil::semihosting
