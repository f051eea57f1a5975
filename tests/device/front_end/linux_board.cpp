// The front end as a Linux program on a pseudo terminal, whose name it prints.
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "tests/device/front_end/circle.hpp"

namespace {

class LinuxBoard : public front_end::Circle {
public:
    LinuxBoard() {
        char name[64];
        termios raw{};
        ::cfmakeraw(&raw);
        if (::openpty(&line_, &other_, name, &raw, nullptr) != 0) {
            std::perror("openpty");
            return;
        }
        ::fcntl(line_, F_SETFL, O_NONBLOCK);
        std::printf("%s\n", name);
        std::fflush(stdout);
    }

    [[nodiscard]] bool is_open() const { return line_ >= 0; }

    std::int64_t now_us() {
        return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - begin_).count();
    }
    bool receive(std::uint8_t& byte) { return ::read(line_, &byte, 1) == 1; }
    bool transmit(std::span<const std::uint8_t> bytes) {
        send();
        if (!unsent_.empty()) {
            return false;
        }
        unsent_.assign(bytes.begin(), bytes.end());
        send();
        return true;
    }
    void drive(int coil) { Circle::drive(coil, now_us()); }
    bool measured(front_end::Window& window) { return Circle::measured(now_us(), window); }
    std::uint16_t faults() { return 0; }
    void rest() {
        send();
        pollfd line{line_, POLLIN, 0};
        ::poll(&line, 1, 1);
    }

private:
    /// The line may take a part; the rest of a frame must follow.
    void send() {
        const ssize_t count = ::write(line_, unsent_.data(), unsent_.size());
        unsent_.erase(unsent_.begin(), unsent_.begin() + std::max<ssize_t>(count, 0));
    }

    std::vector<std::uint8_t> unsent_;
    int line_ = -1;
    int other_ = -1;  // stays open: a host may come and go
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

int main() {
    LinuxBoard board;
    front_end::FrontEnd device(board);
    while (board.is_open()) {
        device.step();
    }
    return 1;
}
