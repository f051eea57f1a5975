#include "board/linux/line_input.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::linux_board {
namespace {

int open_udp(const std::string& option, const host::TcpAddress& address) {
    addrinfo hints{};
    hints.ai_flags = AI_PASSIVE;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(address.host == "*" ? nullptr : address.host.c_str(), address.port.c_str(), &hints, &found) != 0) {
        throw host::InputError(fmt::format("{}: this machine has no address {}", option, address.host));
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, ::freeaddrinfo);
    const int descriptor = ::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0 || ::bind(descriptor, found->ai_addr, found->ai_addrlen) != 0) {
        const std::string reason = std::strerror(errno);
        drivers::FileDescriptor(descriptor).reset();
        throw host::DeviceError(fmt::format("{}: {}; choose another port", option, reason));
    }
    return descriptor;
}

int open_file(const std::string& option, const std::string& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    if (descriptor < 0 || ::fstat(descriptor, &status) != 0 || S_ISDIR(status.st_mode)) {
        const std::string reason = descriptor < 0 ? std::strerror(errno) : "is a folder";
        drivers::FileDescriptor(descriptor).reset();
        throw host::InputError(fmt::format("{}: cannot read it: {}", option, reason));
    }
    return descriptor;
}

}  // namespace

LineInput::LineInput(const std::string& option, const std::string& where) {
    const std::string scheme = where.substr(0, where.find(':') + 1);
    if (where == host::kStandardOutput) {
        input_.reset(::dup(STDIN_FILENO));
    } else if (scheme == "tcp:") {
        listener_ = std::make_unique<host::TcpListener>(option, host::parse_tcp_address(option, where.substr(4)));
    } else if (scheme == "udp:") {
        is_udp_ = true;
        input_.reset(open_udp(option, host::parse_tcp_address(option, where.substr(4))));
    } else {
        is_live_ = false;
        input_.reset(open_file(option, where));
    }
}

bool LineInput::waits(int descriptor, Microseconds patience) const {
    pollfd polled{descriptor, POLLIN, 0};
    const timespec limit{0, std::clamp<std::int64_t>(patience.count(), 0, 999'999) * 1000};
    return ::ppoll(&polled, 1, &limit, nullptr) > 0;
}

void LineInput::read(Microseconds patience) {
    if (!input_.is_open() && listener_ != nullptr && waits(listener_->descriptor(), patience)) {
        input_.reset(listener_->accept());
        patience = Microseconds{0};
    }
    if (!input_.is_open() || (is_live_ && !waits(input_.get(), patience))) {
        return;
    }
    std::array<char, 4096> bytes;
    const ssize_t count = ::read(input_.get(), bytes.data(), bytes.size());
    if (count > 0) {
        text_.append(bytes.data(), static_cast<std::size_t>(count));
        if (is_udp_ && text_.back() != '\n') {
            text_ += '\n';
        }
        return;
    }
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) {
        return;
    }
    if (count < 0 && !is_live_) {
        throw host::ReadError(std::strerror(errno));
    }
    if (!is_udp_ && !text_.empty() && text_.back() != '\n') {
        text_ += '\n';
    }
    if (listener_ != nullptr) {
        input_.reset();
    } else {
        has_ended_ = !is_udp_;
    }
}

std::optional<std::string> LineInput::take_line() {
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos && text_.size() < kLongestLine) {
        return std::nullopt;
    }
    std::string line = text_.substr(0, std::min(end, kLongestLine));
    text_.erase(0, end == std::string::npos ? text_.size() : end + 1);
    if (!line.empty() && line.back() == '\r') {
        line.pop_back();
    }
    ++line_;
    return line;
}

std::optional<std::string> LineInput::next(Microseconds patience) {
    if (auto line = take_line()) {
        return line;
    }
    if (!has_ended_) {
        read(patience);
    }
    return take_line();
}

}  // namespace tricoil::linux_board
