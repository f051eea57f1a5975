// A link to another device that carries protocol messages.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::hal {

/// One received message. The port owns the bytes until its next receive() or close().
struct ReceivedMessage {
    std::span<const std::uint8_t> bytes{};
    HostTime arrival{};                 // on the receiver's clock
    std::int64_t hardware_time_us = 0;  // arrival time on the bus controller's clock; 0: it has no clock
};

/// Counters of a port, except damaged messages.
struct PortCounters {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t send_queue_full = 0;  // messages not sent because the queue was full
    std::uint64_t receive_dropped = 0;  // received messages or transfers that were lost because a buffer was full
    std::uint64_t link_faults = 0;      // bus-off, stalls, failed transfers
    std::uint64_t link_losses = 0;      // link down, unplugged
};

/// Only wait() blocks. After device_lost the port is closed and open() may be called again. Thread context, one thread.
class MessagePort : public Interface {
public:
    /// Opens the device; reopens it if it was open. ok; device_lost: the device is absent, not usable, or not a tricoil device;
    /// see detail().
    Status open() {
        close();
        const Status status = do_open();
        is_open_ = status.ok();
        return status;
    }

    /// Cannot fail; open() may follow.
    void close() {
        if (is_open_) {
            is_open_ = false;
            do_close();
        }
    }
    [[nodiscard]] bool is_open() const { return is_open_; }

    /// Queues one whole message. ok; not_ready: the queue is full or the link is down for now; this message is dropped and
    /// counted; invalid_argument: longer than the longest message; device_lost.
    Status send(std::span<const std::uint8_t> message) { return is_open_ ? noted(do_send(message), &counters_.sent) : kClosed; }

    /// Returns the oldest received message. ok; not_ready: none yet; device_lost.
    Status receive(ReceivedMessage& message) { return is_open_ ? noted(do_receive(message), &counters_.received) : kClosed; }

    /// Waits until receive() may return a message, at most for `timeout`. ok; timed_out; device_lost.
    Status wait(Microseconds timeout) { return is_open_ ? noted(do_wait(timeout), nullptr) : kClosed; }

    /// Explanation of the last failed open() or the last link loss: the device, the problem, and the remedy. Empty if there is
    /// none.
    [[nodiscard]] const char* detail() const { return do_detail(); }

    [[nodiscard]] const PortCounters& counters() const { return counters_; }
    /// Damaged frames by kind.
    [[nodiscard]] const protocol::WireCounters& wire_errors() const { return wire_errors_; }

protected:
    PortCounters& counts() { return counters_; }
    protocol::WireCounters& damaged() { return wire_errors_; }

private:
    static constexpr Status kClosed{StatusCode::device_lost, "port is closed"};

    Status noted(Status status, std::uint64_t* successes) {
        if (status.code() == StatusCode::device_lost) {
            close();
        } else if (status.ok() && successes != nullptr) {
            ++*successes;
        }
        return status;
    }

    // Called only for a port that is closed (do_open) or open (the others).
    virtual Status do_open() = 0;
    virtual void do_close() = 0;
    virtual Status do_send(std::span<const std::uint8_t> message) = 0;
    virtual Status do_receive(ReceivedMessage& message) = 0;
    virtual Status do_wait(Microseconds timeout) = 0;
    [[nodiscard]] virtual const char* do_detail() const = 0;

    PortCounters counters_;
    protocol::WireCounters wire_errors_;
    bool is_open_ = false;
};

}  // namespace tricoil::hal
