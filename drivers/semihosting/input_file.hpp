// A file of the host, for reading.
#pragma once

#include <cstdint>

namespace tricoil::semihosting {

class InputFile {
public:
    /// `name`: path on the host, from the emulator's working directory; zero-terminated.
    explicit InputFile(const char* name);

    [[nodiscard]] bool is_open() const { return handle_ >= 0; }

    /// Reads the next `bytes` bytes; false if fewer are left.
    bool read(void* to, std::uint32_t bytes);

private:
    std::int32_t handle_;
};

}  // namespace tricoil::semihosting
