// Lines of text from a file, standard input, a TCP client or UDP datagrams.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "board/support/errors.hpp"
#include "board/support/limited_notice.hpp"
#include "board/support/output_file.hpp"
#include "board/support/python_part.hpp"
#include "board/support/tcp_listener.hpp"
#include "core/base/time.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/poll.hpp"

namespace tricoil::linux_board {

class LineInput {
public:
    /// Longer lines are cut to this length.
    static constexpr std::size_t kLongestLine = std::size_t{1} << 16U;

    /// where: "-", "tcp:[ADDRESS:]PORT", "udp:[ADDRESS:]PORT" or a file; addresses are of this machine, loopback by default.
    /// name: begin of messages. Throws InputError for a wrong name, DeviceError for a port in use.
    LineInput(const std::string& name, const std::string& where) : notice_(name) {
        const std::string scheme = where.substr(0, where.find(':') + 1);
        if (where == host::kStandardOutput) {
            input_.reset(::dup(STDIN_FILENO));
            host::refuse_if(!input_.is_open(), "{}: standard input is closed", name);
        } else if (scheme == "tcp:" || scheme == "udp:") {
            const std::string option = name.substr(0, name.find(':') + 1) + scheme;
            const auto address = host::parse_tcp_address(option, where.substr(scheme.size()));
            is_udp_ = scheme == "udp:";
            if (is_udp_) {
                input_ = host::bind_socket(option, address, SOCK_DGRAM);
            } else {
                listener_ = std::make_unique<host::TcpListener>(option, address);
            }
            host::warn_of_exposure(option, address, "send couplings, which become poses");
        } else {
            input_ = open_file(name, where, is_live_);
        }
    }

    /// The next line, without its line end. Nullopt if none came in `patience`, or at the end.
    std::optional<std::string> next(Microseconds patience) {
        if (auto line = take_line()) {
            return line;
        }
        if (!has_ended_) {
            read(patience);
        }
        return take_line();
    }

    [[nodiscard]] bool was_cut() const { return was_cut_; }  // the last line was longer than kLongestLine
    /// Number of the last line of this sender, from 1.
    [[nodiscard]] std::size_t line() const { return line_; }
    /// Counts the senders of a port, one after the other.
    [[nodiscard]] int sender() const { return sender_; }
    /// True for TCP: each sender is another device. Anybody may send datagrams.
    [[nodiscard]] bool has_clients() const { return listener_ != nullptr; }
    /// True if a file or pipe has no more lines. Ports have no end: another client may come.
    [[nodiscard]] bool has_ended() const { return has_ended_ && text_.empty(); }
    /// False for a regular file: its lines wait.
    [[nodiscard]] bool is_live() const { return is_live_; }
    /// True for a port: its senders do not wait, or what they send becomes old.
    [[nodiscard]] bool is_lossy() const { return is_udp_ || listener_ != nullptr; }

private:
    static constexpr Microseconds kClientSilence{5'000'000};  // then a waiting client replaces the present one
    /// Not a regular file: a pipe or a terminal, which are read as they come.
    static drivers::FileDescriptor open_file(const std::string& name, const std::string& path, bool& is_live) {
        if (drivers::FileDescriptor table = host::plain_text_of(path); table.is_open()) {
            is_live = ::lseek(table.get(), 0, SEEK_SET) != 0;
            return table;
        }
        drivers::FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
        struct stat status {};
        const char* const reason = !file.is_open() || ::fstat(file.get(), &status) != 0 ? std::strerror(errno) : "is a folder";
        host::refuse_if(!file.is_open() || S_ISDIR(status.st_mode), "{}: cannot read it: {}", name, reason);
        is_live = !S_ISREG(status.st_mode);
        return file;
    }
    static bool has_data(int descriptor, Microseconds patience) { return drivers::wait_readable(descriptor, patience).ok(); }

    /// One client at a time. A second one waits while the first has lines to read, and is then refused, unless the first is
    /// silent.
    void accept_client(Microseconds patience) {
        if (!has_data(listener_->descriptor(), input_.is_open() ? Microseconds{0} : patience)) {
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
        input_ = std::move(client);
        ++sender_;
        line_ = 0;
        is_cut_ = is_cut_ && !text_.empty();
    }
    void receive_datagram() {
        sockaddr_storage from{};
        socklen_t size = sizeof from;
        auto* const address_bytes = reinterpret_cast<sockaddr*>(&from);  // NOLINT: socket interface
        const ssize_t count = ::recvfrom(input_.get(), received_.data(), received_.size(), 0, address_bytes, &size);
        if (count <= 0) {
            return;
        }
        if (std::string address = host::address_text(from); address != client_) {
            client_ = std::move(address);
            ++sender_;
            line_ = 0;
        }
        text_.append(received_.data(), static_cast<std::size_t>(count));
        if (text_.back() != '\n') {
            text_ += '\n';
        }
    }
    void read(Microseconds patience) {
        if (listener_ != nullptr && !(input_.is_open() && has_data(input_.get(), Microseconds{0}))) {
            accept_client(patience);
        }
        if (!input_.is_open() || (is_live_ && !has_data(input_.get(), patience))) {
            return;
        }
        if (is_udp_) {
            receive_datagram();
            return;
        }
        const ssize_t count = ::read(input_.get(), received_.data(), received_.size());
        if (count > 0) {
            text_.append(received_.data(), static_cast<std::size_t>(count));
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
    /// Part of a line that a broken connection leaves is not read.
    void end_of_sender(bool is_clean) {
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
    /// Lines of a sender that has gone are still its own.
    std::optional<std::string> take_line() {
        std::size_t end = text_.find('\n');
        if (is_cut_) {  // the rest of a line
            text_.erase(0, end == std::string::npos ? end : end + 1);
            is_cut_ = end == std::string::npos;
            end = text_.find('\n');
        }
        if (end == std::string::npos && text_.size() <= kLongestLine + 1) {  // its end may still come, after a carriage return
            return std::nullopt;
        }
        is_cut_ = end == std::string::npos;
        std::string line = text_.substr(0, end);
        text_.erase(0, is_cut_ ? end : end + 1);
        if (!is_cut_ && line.ends_with('\r')) {
            line.pop_back();
        }
        was_cut_ = line.size() > kLongestLine;
        line.resize(std::min(line.size(), kLongestLine));
        ++line_;
        return line;
    }

    host::LimitedNotice notice_;
    std::unique_ptr<host::TcpListener> listener_;  // of tcp:
    drivers::FileDescriptor input_;                // not open: tcp: without a client
    std::string client_;                           // address of the sender of a port
    HostTime heard_;                               // from a TCP client
    bool is_live_ = true;
    bool is_udp_ = false;
    bool has_ended_ = false;
    std::vector<char> received_ = std::vector<char>(kLongestLine);  // by one read; no datagram is longer
    std::string text_;                                              // not yet taken
    bool is_cut_ = false;                                           // the last line; its rest follows
    bool was_cut_ = false;
    std::size_t line_ = 0;
    int sender_ = 0;
};

}  // namespace tricoil::linux_board
