// Message port that measures how far the host is behind.
#pragma once

#include <deque>
#include <vector>

#include "hal/message_port.hpp"

namespace tricoil::sim_front_end {

/// Forwards messages in order. Compares the sent poses or columns with those that the host's keep-alive messages acknowledge.
class HostWatchingPort final : public hal::MessagePort {
public:
    /// `port` must be open and must outlive this object.
    explicit HostWatchingPort(hal::MessagePort& port) : port_(port) {}

    /// Queues the arrived messages for receive(). now: the host's monotonic clock.
    void listen(HostTime now);

    /// Appends a stop command to the arrived messages.
    void pretend_stop();

    /// True if a message other than keep_alive, or the loss of the link, waits to be received.
    [[nodiscard]] bool has_command() const { return commands_ > 0 || is_lost_; }
    /// Number of sent poses or columns that the host has not acknowledged.
    [[nodiscard]] std::uint32_t ahead() const { return has_sent_ ? sent_ - acknowledged_ : 0; }
    /// Arrival time of the host's newest message.
    [[nodiscard]] HostTime heard() const { return heard_; }
    [[nodiscard]] std::uint64_t unsent() const { return unsent_; }

    /// Starts a new stream: ahead() is 0.
    void catch_up() { has_sent_ = false; }

private:
    struct Arrived {
        std::vector<std::uint8_t> bytes;
        bool is_command = false;  // other than keep_alive
    };

    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override { return port_.wait(timeout); }
    [[nodiscard]] const char* do_detail() const override { return port_.detail(); }

    void take(std::vector<std::uint8_t> bytes);
    void note_sent(std::uint32_t sequence);

    hal::MessagePort& port_;
    bool is_open_ = true;
    bool is_lost_ = false;
    std::deque<Arrived> arrived_;
    std::vector<std::uint8_t> taken_;
    std::size_t commands_ = 0;
    bool has_sent_ = false;           // true after the first message of this stream
    std::uint32_t sent_ = 0;          // sequence after the newest one sent
    std::uint32_t acknowledged_ = 0;  // sequence after the newest acknowledged one
    HostTime heard_;
    std::uint64_t unsent_ = 0;
};

}  // namespace tricoil::sim_front_end
