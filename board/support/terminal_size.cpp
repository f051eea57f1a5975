#include "board/support/terminal_size.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

namespace tricoil::host {

std::size_t terminal_width(std::FILE* file) {
    constexpr std::size_t kUsual = 80;
    winsize size{};
    return ::ioctl(::fileno(file), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

}  // namespace tricoil::host
