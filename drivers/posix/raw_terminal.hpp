// A terminal as a raw byte stream.
#pragma once

#include <fcntl.h>
#include <termios.h>

#include <array>
#include <cstdlib>
#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::drivers {

/// No echo, no line editing, no translation; read() returns the available bytes. speed: for example B9600; B0 keeps the present
/// speed. False if `fd` is not a terminal.
inline bool make_raw(int fd, speed_t speed = B0) {
    termios settings{};
    if (::tcgetattr(fd, &settings) != 0) {
        return false;
    }
    ::cfmakeraw(&settings);
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (speed != B0) {
        ::cfsetspeed(&settings, speed);
    }
    return ::tcsetattr(fd, TCSANOW, &settings) == 0;
}

/// A new pseudo terminal in raw mode. Returns the path of its slave; empty if none is available.
inline std::string open_pseudo_terminal(FileDescriptor& master, FileDescriptor& slave) {
    master.reset(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    std::array<char, 64> name{};
    if (!master.is_open() || ::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0 ||
        ::ptsname_r(master.get(), name.data(), name.size()) != 0) {
        return {};
    }
    slave.reset(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
    make_raw(slave.get());
    return name.data();
}

}  // namespace tricoil::drivers
