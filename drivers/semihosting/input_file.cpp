#include "drivers/semihosting/input_file.hpp"

#include <cstring>

#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {
namespace {

constexpr std::uint32_t kOpenReadBinary = 1;  // "rb"

struct OpenBlock {
    const char* name;
    std::uint32_t mode;
    std::uint32_t name_length;
};

struct ReadBlock {
    std::int32_t handle;
    void* to;
    std::uint32_t bytes;
};

}  // namespace

InputFile::InputFile(const char* name) {
    const OpenBlock block{name, kOpenReadBinary, static_cast<std::uint32_t>(std::strlen(name))};
    handle_ = call(Operation::open, &block);
}

bool InputFile::read(void* to, std::uint32_t bytes) {
    const ReadBlock block{handle_, to, bytes};
    return is_open() && call(Operation::read, &block) == 0;  // the call returns the number of bytes not read
}

}  // namespace tricoil::semihosting
