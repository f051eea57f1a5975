#include "board/linux/line_input.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kClientSilence{5'000'000};  // then a waiting client replaces the present one

int open_udp(const std::string& name, const host::TcpAddress& address) {
    addrinfo hints{};
    hints.ai_flags = AI_PASSIVE;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(address.host == "*" ? nullptr : address.host.c_str(), address.port.c_str(), &hints, &found) != 0) {
        throw host::InputError(fmt::format("{}: this machine has no address {}", name, address.host));
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, ::freeaddrinfo);
    const int descriptor = ::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0 || ::bind(descriptor, found->ai_addr, found->ai_addrlen) != 0) {
        const int error = errno;
        drivers::FileDescriptor(descriptor).reset();
        if (error == EADDRNOTAVAIL) {
            throw host::InputError(fmt::format("{}: this machine has no address {}", name, address.host));
        }
        throw host::DeviceError(fmt::format("{}: {}; choose another port", name, std::strerror(error)));
    }
    return descriptor;
}

/// Not a regular file: a pipe or a terminal, which are read as they come.
int open_file(const std::string& name, const std::string& path, bool& is_live) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    struct stat status {};
    if (descriptor < 0 || ::fstat(descriptor, &status) != 0 || S_ISDIR(status.st_mode)) {
        const std::string reason = descriptor < 0 ? std::strerror(errno) : "is a folder";
        drivers::FileDescriptor(descriptor).reset();
        throw host::InputError(fmt::format("{}: cannot read it: {}", name, reason));
    }
    is_live = !S_ISREG(status.st_mode);
    return descriptor;
}

bool waits(int descriptor, Microseconds patience) {
    pollfd polled{descriptor, POLLIN, 0};
    const timespec limit{0, std::clamp<std::int64_t>(patience.count(), 0, 999'999) * 1000};
    return ::ppoll(&polled, 1, &limit, nullptr) > 0;
}

void warn_of_exposure(const std::string& name, const host::TcpAddress& address) {
    if (!address.is_loopback()) {
        host::print_notice("tricoil: {}: everyone who reaches this address can send couplings, which become poses\n", name);
    }
}

}  // namespace

LineInput::LineInput(const std::string& name, const std::string& where) : notice_(name) {
    const std::string scheme = where.substr(0, where.find(':') + 1);
    if (where == host::kStandardOutput) {
        input_.reset(::dup(STDIN_FILENO));
        if (!input_.is_open()) {
            throw host::InputError(name + ": standard input is closed");
        }
    } else if (scheme == "tcp:") {
        const auto address = host::parse_tcp_address(name, where.substr(4));
        listener_ = std::make_unique<host::TcpListener>(name, address);
        warn_of_exposure(name, address);
    } else if (scheme == "udp:") {
        const auto address = host::parse_tcp_address(name, where.substr(4));
        is_udp_ = true;
        input_.reset(open_udp(name, address));
        warn_of_exposure(name, address);
    } else {
        input_.reset(open_file(name, where, is_live_));
    }
}

/// One client at a time. A second one waits while the first has lines to read, and is then refused, unless the first is silent.
void LineInput::accept_client(Microseconds patience) {
    if (!waits(listener_->descriptor(), input_.is_open() ? Microseconds{0} : patience)) {
        return;
    }
    drivers::FileDescriptor client(listener_->accept());
    if (!client.is_open()) {
        return;
    }
    const std::string address = host::peer_text(client.get());
    if (input_.is_open()) {
        if (drivers::host_now() - heard_ < kClientSilence) {
            notice_.print(fmt::format("client {} is refused: {} sends", address, client_));
            return;
        }
        end_of_sender(false);
    }
    client_ = address;
    heard_ = drivers::host_now();
    notice_.print(fmt::format("client {} is connected", client_));
    input_.reset(::dup(client.get()));
    ++sender_;
    line_ = 0;
}

void LineInput::receive_datagram() {
    std::vector<char> bytes(kLongestLine);  // no datagram is longer
    sockaddr_storage from{};
    socklen_t size = sizeof from;
    const ssize_t count = ::recvfrom(input_.get(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from),
                                     &size);  // NOLINT: socket interface
    if (count <= 0) {
        return;
    }
    if (std::string address = host::address_text(from); address != client_) {
        client_ = std::move(address);
        ++sender_;
        line_ = 0;
    }
    text_.append(bytes.data(), static_cast<std::size_t>(count));
    if (text_.back() != '\n') {
        text_ += '\n';
    }
}

/// Part of a line that a broken connection leaves is not read.
void LineInput::end_of_sender(bool is_clean) {
    if (is_clean && !text_.empty() && text_.back() != '\n') {
        text_ += '\n';
    } else if (!is_clean) {
        text_.erase(text_.find_last_of('\n') + 1);
    }
    if (listener_ == nullptr) {
        has_ended_ = true;
        return;
    }
    notice_.print(fmt::format("client {} has gone", client_));
    input_.reset();
}

void LineInput::read(Microseconds patience) {
    if (listener_ != nullptr && !(input_.is_open() && waits(input_.get(), Microseconds{0}))) {
        accept_client(patience);
    }
    if (!input_.is_open() || (is_live_ && !waits(input_.get(), patience))) {
        return;
    }
    if (is_udp_) {
        receive_datagram();
        return;
    }
    std::vector<char> bytes(kLongestLine);
    const ssize_t count = ::read(input_.get(), bytes.data(), bytes.size());
    if (count > 0) {
        text_.append(bytes.data(), static_cast<std::size_t>(count));
        heard_ = drivers::host_now();
    } else if (count == 0) {
        end_of_sender(true);
    } else if (errno != EINTR && errno != EAGAIN) {
        if (!is_live_) {
            throw host::ReadError(fmt::format("{}: {}", notice_.name(), std::strerror(errno)));
        }
        end_of_sender(false);
    }
}

/// Lines of a sender that has gone are still its own.
std::optional<std::string> LineInput::take_line() {
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos && text_.size() < kLongestLine) {
        return std::nullopt;
    }
    std::string line = text_.substr(0, std::min(end, kLongestLine));
    text_.erase(0, end == std::string::npos ? kLongestLine : end + 1);
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
