#include "board/host/serve/button_input.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "board/support/errors.hpp"
#include "drivers/posix/raw_terminal.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kLongestLine = 16;

int open_device(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) {
        throw DeviceError(fmt::format("--button {}: cannot be opened ({}); is it plugged in?", path, std::strerror(errno)));
    }
    refuse_if(!S_ISCHR(status.st_mode) && !S_ISFIFO(status.st_mode),
              "--button {}: must be -, a terminal, a serial port or a named pipe", path);
    // O_RDWR: a named pipe does not end when its writer leaves.
    const int descriptor = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        throw DeviceError(fmt::format("--button {}: cannot be opened ({}){}", path, std::strerror(errno),
                                      errno == EACCES ? "; add yourself to the group dialout" : ""));
    }
    drivers::make_raw(descriptor);  // no effect on a named pipe
    return descriptor;
}

}  // namespace

// Standard input may be shared with other programs, so it stays blocking; handle() reads only what poll() reports.
ButtonInput::ButtonInput(const std::string& where, StylusButton& button)
    : button_(button), input_(where == kStandardInput ? ::dup(STDIN_FILENO) : open_device(where)) {}

bool ButtonInput::watch(std::vector<pollfd>& descriptors) {
    if (input_.is_open()) {
        descriptors.push_back({input_.get(), POLLIN, 0});
    }
    return false;
}

void ButtonInput::handle() {
    pollfd descriptor{input_.get(), POLLIN, 0};
    if (!input_.is_open() || ::poll(&descriptor, 1, 0) <= 0) {
        return;
    }
    std::array<char, 64> buffer{};
    const ssize_t n = ::read(input_.get(), buffer.data(), buffer.size());
    if (n > 0) {
        std::for_each_n(buffer.begin(), n, [this](char c) { character(c); });
    } else if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
        input_.reset();
        button_.set(false);
    }
}

void ButtonInput::character(char c) {
    if (c != '\n') {
        line_ += line_.size() < kLongestLine && c != '\r' ? std::string(1, c) : std::string();
        return;
    }
    if (line_.empty()) {
        button_.click();
    } else if (line_ == "0" || line_ == "1") {
        button_.set(line_ == "1");
    }
    line_.clear();
}

}  // namespace tricoil::host
