#include "board/host/demo/key_press.hpp"

#include <poll.h>
#include <unistd.h>

namespace tricoil::host {

KeyPress::KeyPress() {
    termios settings{};
    if (::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &settings) == 0) {
        before_ = settings;
        settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C stays a signal
        (void)::tcsetattr(STDIN_FILENO, TCSANOW, &settings);
    }
}

KeyPress::~KeyPress() {
    if (before_) {
        (void)::tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
    }
}

std::optional<char> KeyPress::take() {
    std::optional<char> key;
    pollfd input{STDIN_FILENO, POLLIN, 0};
    while (before_ && ::poll(&input, 1, 0) == 1) {  // an arrow key sends several bytes: they count as one key
        char byte = 0;
        if (::read(STDIN_FILENO, &byte, 1) != 1) {
            break;
        }
        key = key.value_or(byte);
    }
    return key;
}

}  // namespace tricoil::host
