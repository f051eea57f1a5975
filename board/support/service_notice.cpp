#include "board/support/service_notice.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace tricoil::host {
namespace {

std::string_view variable(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::string_view() : std::string_view(value);
}

}  // namespace

ServiceNotice::ServiceNotice() : address_(variable("NOTIFY_SOCKET")) {
    if (address_.empty()) {
        return;
    }
    if (address_.front() == '@') {
        address_.front() = '\0';  // abstract socket name
    }
    socket_.reset(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    const std::string_view watchdog = variable("WATCHDOG_USEC");
    std::int64_t period_us = 0;
    std::from_chars(watchdog.data(), watchdog.data() + watchdog.size(), period_us);
    period_ = std::chrono::microseconds(period_us / 2);
}

bool writes_to_journal() {
    const std::string_view stream = variable("JOURNAL_STREAM");
    return std::ranges::any_of(std::array{STDOUT_FILENO, STDERR_FILENO}, [&](int descriptor) {
        struct stat file {};
        return ::fstat(descriptor, &file) == 0 && stream == fmt::format("{}:{}", file.st_dev, file.st_ino);
    });
}

void ServiceNotice::alive() {
    const auto now = std::chrono::steady_clock::now();
    if (period_.count() > 0 && now >= due_) {
        send("WATCHDOG=1");
        due_ = now + period_;
    }
}

void ServiceNotice::send(std::string_view text) const {
    sockaddr_un to{};
    if (address_.empty() || address_.size() >= sizeof to.sun_path) {
        return;
    }
    to.sun_family = AF_UNIX;
    address_.copy(to.sun_path, address_.size());
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
    (void)::sendto(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
                   size);  // NOLINT
}

}  // namespace tricoil::host
