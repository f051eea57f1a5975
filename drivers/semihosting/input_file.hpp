// A file of the host, for reading.
#pragma once

#include <cstdint>
#include <cstring>

#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {

class InputFile {
public:
    /// `name`: path on the host, from the emulator's working directory; zero-terminated.
    explicit InputFile(const char* name) {
        const OpenBlock block{name, kOpenReadBinary, static_cast<std::uint32_t>(std::strlen(name))};
        handle_ = call(Operation::open, &block);
    }

    [[nodiscard]] bool is_open() const { return handle_ >= 0; }

    /// Reads the next `bytes` bytes; false if fewer are left.
    bool read(void* to, std::uint32_t bytes) {
        const ReadBlock block{handle_, to, bytes};
        return is_open() && call(Operation::read, &block) == 0;  // the call returns the number of bytes not read
    }

private:
    static constexpr std::uint32_t kOpenReadBinary = 1;  // "rb"
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

    std::int32_t handle_;
};

}  // namespace tricoil::semihosting
