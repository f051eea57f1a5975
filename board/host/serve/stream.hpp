// Connection to one client, without waiting.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

struct StreamLimits {
    std::chrono::milliseconds oldest = std::chrono::hours(24);  // records that wait longer are dropped, unless partly sent
    int socket_bytes = 0;                                       // send buffer of the socket; 0: system default
    std::size_t share = 12;                                     // bytes per read
};

/// While the connection lasts, a record is sent completely or not at all. A new record is dropped and counted if more than
/// kMaxWaiting bytes would wait; if nothing waits, it may be longer. Input is read in chunks (`share`), with a pause after a full
/// chunk: by default about 12 kB/s (a FASTRAK line at 115,200 baud carries 11.5 kB/s). Nothing is read while more than kMaxUnread
/// bytes wait for the client. A client that floods therefore does not delay the others.
class Stream {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::size_t kMaxWaiting = 64 * 1024;
    static constexpr std::chrono::milliseconds kSharePause{1};  // pause after a full chunk
    static constexpr std::size_t kMaxUnread = 4096;             // waiting bytes above which reading stops

    /// Takes ownership of the descriptor and makes it non-blocking.
    explicit Stream(int descriptor, const StreamLimits& limits = {});
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }
    /// Keeps the client's place, of ConnectionTable, instead of the earlier one.
    void hold(std::shared_ptr<const void> place) { place_ = std::move(place); }

    /// Sends or queues a record. False if it was dropped.
    bool send(std::string_view record);

    /// Reads at most one chunk. Valid until the next call. Empty: no data, pause, too many waiting bytes,
    /// or the client is gone.
    std::span<const char> receive();

    /// Events for poll(): POLLIN if a chunk may be read, POLLOUT if records wait.
    [[nodiscard]] short events() const;
    /// True during the pause after a full chunk: poll() must then use a short time-out.
    [[nodiscard]] bool pauses() const { return Clock::now() < next_share_; }

    /// Sends waiting records as far as the client accepts them.
    void flush();

    [[nodiscard]] bool has_waiting() const { return !waiting_.empty(); }
    /// Number of waiting bytes.
    [[nodiscard]] std::size_t waiting() const { return bytes_waiting_; }
    [[nodiscard]] bool gone() const { return gone_; }
    /// Marks the client for disconnection.
    void disconnect() { gone_ = true; }
    /// disconnect(), for a reason that the server prints.
    void refuse(std::string reason) {
        reason_ = std::move(reason);
        gone_ = true;
    }
    [[nodiscard]] const std::string& reason() const { return reason_; }
    /// Starts with a new client on the same line. Discards records for the previous one.
    void restart() {
        gone_ = false;
        forget_all();
    }
    /// Number of records that were dropped because the client read too slowly.
    [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

private:
    struct Record {
        std::string bytes;  // unsent part
        Clock::time_point since;
        bool begun = false;  // partly sent
    };

    void drop_old();
    void forget_all();
    [[nodiscard]] bool may_receive() const { return !pauses() && bytes_waiting_ <= kMaxUnread; }

    drivers::FileDescriptor descriptor_;
    std::shared_ptr<const void> place_;  // ends before the descriptor
    std::chrono::milliseconds oldest_;
    std::deque<Record> waiting_;
    std::size_t bytes_waiting_ = 0;
    std::vector<char> share_;
    Clock::time_point next_share_{};
    bool gone_ = false;
    std::string reason_;
    std::uint64_t dropped_ = 0;
};

}  // namespace tricoil::host
