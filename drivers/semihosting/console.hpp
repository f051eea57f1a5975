// Console on the host's terminal.
#pragma once

#include <cstdint>

#include "drivers/semihosting/call.hpp"
#include "hal/console.hpp"

namespace tricoil::semihosting {

class Console final : public hal::Console {
public:
    Console() : handle_(open_terminal()) {}

private:
    static constexpr char kTerminal[] = ":tt";  // name defined by the specification
    static constexpr std::uint32_t kOpenWrite = 4;
    struct OpenBlock {
        const char* name;
        std::uint32_t mode;
        std::uint32_t name_length;
    };
    struct WriteBlock {
        std::int32_t handle;
        const char* text;
        std::uint32_t length;
    };
    static std::int32_t open_terminal() {
        const OpenBlock block{kTerminal, kOpenWrite, sizeof(kTerminal) - 1};
        return call(Operation::open, &block);
    }

    Status do_write(std::string_view text) override {
        const WriteBlock block{handle_, text.data(), static_cast<std::uint32_t>(text.size())};
        if (handle_ < 0 || call(Operation::write, &block) != 0) {
            return {StatusCode::device_lost, "the host's terminal does not accept text"};
        }
        return {};
    }

    std::int32_t handle_;
};

}  // namespace tricoil::semihosting
