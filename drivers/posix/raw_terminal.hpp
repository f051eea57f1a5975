// A terminal as a plain line of bytes.
#pragma once

#include <termios.h>

namespace tricoil::drivers {

/// No echo, no editing, no translation; reads return what there is. speed: B9600 and its like; B0 leaves it as it stands. False
/// if `fd` is no terminal.
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
