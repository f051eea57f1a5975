// A terminal as a raw byte stream.
#pragma once

#include <termios.h>

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

}  // namespace tricoil::drivers
