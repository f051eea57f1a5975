// A link to another device that carries protocol messages.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::hal {

/// One message as it came; the bytes belong to the port until its next receive() or close().
struct ReceivedMessage {
    std::span<const std::uint8_t> bytes{};
    std::int64_t host_time_us = 0;      // when it arrived, on the host's monotonic clock
    std::int64_t hardware_time_us = 0;  // on the bus controller's own clock; 0: it has none
};

/// What a port counts beside damaged messages.
struct PortCounters {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t send_queue_full = 0;  // messages not sent for want of room
    std::uint64_t receive_dropped = 0;  // messages or transfers that the host could not take in time
    std::uint64_t link_faults = 0;      // bus-off, stalls, failed transfers
    std::uint64_t link_losses = 0;      // link down, unplugged
};

/// Nothing here waits but wait(). After device_lost the port is closed and open() may be called again. Thread context, one
/// thread.
class MessagePort {
public:
    MessagePort() = default;
    MessagePort(const MessagePort&) = delete;
    MessagePort& operator=(const MessagePort&) = delete;
    virtual ~MessagePort() = default;

    /// Opens the device, anew if it was open. ok; device_lost: it is not there, not usable, or not ours; see detail().
    Status open() { return do_open(); }

    /// Cannot fail; open() may follow.
    void close() { do_close(); }

    /// Hands over one whole message. ok; not_ready: no room, or the link is down for now: this message is dropped, and counted;
    /// invalid_argument: longer than any message; device_lost.
    Status send(std::span<const std::uint8_t> message) { return do_send(message); }

    /// The oldest message received. ok; not_ready: none yet; device_lost.
    Status receive(ReceivedMessage& message) { return do_receive(message); }

    /// Waits until receive() may have something, `timeout` at most. ok; timed_out; device_lost.
    Status wait(Microseconds timeout) { return do_wait(timeout); }

    /// What open() or the last loss had to say: the thing, what is wrong with it, and the mend; empty if nothing.
    [[nodiscard]] const char* detail() const { return do_detail(); }

    [[nodiscard]] const PortCounters& counters() const { return counters_; }
    /// Damaged frames by kind.
    [[nodiscard]] const protocol::WireCounters& wire_errors() const { return wire_errors_; }

protected:
    PortCounters& counts() { return counters_; }
    protocol::WireCounters& damaged() { return wire_errors_; }

private:
    virtual Status do_open() = 0;
    virtual void do_close() = 0;
    virtual Status do_send(std::span<const std::uint8_t> message) = 0;
    virtual Status do_receive(ReceivedMessage& message) = 0;
    virtual Status do_wait(Microseconds timeout) = 0;
    [[nodiscard]] virtual const char* do_detail() const = 0;

    PortCounters counters_;
    protocol::WireCounters wire_errors_;
};

}  // namespace tricoil::hal
