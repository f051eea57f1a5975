// An open line to one client that is never waited for.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

struct StreamLimits {
    std::chrono::milliseconds oldest = std::chrono::hours(24);  // records that have waited for longer are dropped
    int socket_bytes = 0;                                       // that the system may hold back for the client; 0: as it likes
};

/// Records go out whole or not at all: while the client has kMostWaiting bytes to read, new ones are dropped and counted. What a
/// client asks for is read in small shares with pauses between them, 12 kB/s at most (a FASTRAK's line at 115,200 baud carries
/// 11.5 kB/s), and not while the client leaves answers unread: a client that floods costs little, and delays no other.
class Stream {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::size_t kMostWaiting = 64 * 1024;
    static constexpr std::size_t kShare = 12;                   // bytes that are read at once
    static constexpr std::chrono::milliseconds kSharePause{1};  // after a full share
    static constexpr std::size_t kMostUnread = 4096;            // bytes of answers; beyond, nothing more is read

    /// Takes the descriptor, and makes it non-blocking.
    explicit Stream(int descriptor, const StreamLimits& limits = {});
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }

    /// False if the record was dropped.
    bool send(std::string_view record);

    /// What has come, at most a share, valid until the next call; empty: nothing, or not yet, or the client is gone.
    std::span<const char> receive();

    /// For poll(): POLLIN if a share may be read, POLLOUT if records wait.
    [[nodiscard]] short events() const;
    /// Whether the pause after a full share is still on: poll() must not wait much longer than that.
    [[nodiscard]] bool pauses() const { return Clock::now() < next_share_; }

    /// Sends what waits, as far as the client takes it.
    void flush();

    [[nodiscard]] bool has_waiting() const { return !waiting_.empty(); }
    /// Bytes.
    [[nodiscard]] std::size_t waiting() const { return bytes_waiting_; }
    [[nodiscard]] bool gone() const { return gone_; }
    /// The client is to be let go once this has been seen.
    void hang_up() { gone_ = true; }
    /// The line is there again, or another client on it: what waited was for the one before.
    void begin_anew() {
        gone_ = false;
        forget_all();
    }
    [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

private:
    struct Record {
        std::string bytes;  // what of it has not gone out
        Clock::time_point since;
        bool begun = false;
    };

    void drop_old();
    void forget_all();
    [[nodiscard]] bool may_receive() const { return !pauses() && bytes_waiting_ <= kMostUnread; }

    drivers::FileDescriptor descriptor_;
    std::chrono::milliseconds oldest_;
    std::deque<Record> waiting_;
    std::size_t bytes_waiting_ = 0;
    std::array<char, kShare> share_{};
    Clock::time_point next_share_{};
    bool gone_ = false;
    std::uint64_t dropped_ = 0;
};

}  // namespace tricoil::host
