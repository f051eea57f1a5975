#include "drivers/semihosting/console.hpp"

#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {
namespace {

constexpr char kTerminal[] = ":tt";  // name defined by the specification
constexpr std::uint32_t kOpenWrite = 4;

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

std::int32_t open_terminal() {
    const OpenBlock block{kTerminal, kOpenWrite, sizeof(kTerminal) - 1};
    return call(Operation::open, &block);
}

}  // namespace

Console::Console() : handle_(open_terminal()) {}

Status Console::do_write(std::string_view text) {
    const WriteBlock block{handle_, text.data(), static_cast<std::uint32_t>(text.size())};
    if (handle_ < 0 || call(Operation::write, &block) != 0) {
        return {StatusCode::device_lost, "the host's terminal does not accept text"};
    }
    return {};
}

}  // namespace tricoil::semihosting
