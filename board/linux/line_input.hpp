// Lines of text from a file, standard input, a TCP client or UDP datagrams.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/support/limited_notice.hpp"
#include "board/support/tcp_listener.hpp"
#include "core/base/time.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::linux_board {

class LineInput {
public:
    /// Longer lines are cut to this length.
    static constexpr std::size_t kLongestLine = std::size_t{1} << 16U;

    /// where: "-", "tcp:[ADDRESS:]PORT", "udp:[ADDRESS:]PORT" or a file; addresses are of this machine, loopback by default.
    /// name: begin of messages. Throws InputError for a wrong name, DeviceError for a port in use.
    LineInput(const std::string& name, const std::string& where);

    /// The next line, without its line end. Nullopt if none came in `patience`, or at the end.
    std::optional<std::string> next(Microseconds patience);

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
    void accept_client(Microseconds patience);
    void receive_datagram();
    void read(Microseconds patience);
    void end_of_sender(bool is_clean);
    std::optional<std::string> take_line();

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
