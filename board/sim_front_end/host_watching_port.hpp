// A port that sees how far the host has come.
#pragma once

#include <deque>
#include <vector>

#include "hal/message_port.hpp"

namespace tricoil::sim_front_end {

/// Passes messages on, in order. Compares the poses or columns that are sent with those that the host's keep-alives acknowledge.
class HostWatchingPort final : public hal::MessagePort {
public:
    /// `port` is open, and outlives this.
    explicit HostWatchingPort(hal::MessagePort& port) : port_(port) {}

    /// Takes in what has arrived, for receive(). now_us: the host's monotonic clock.
    void listen(std::int64_t now_us);

    /// Puts a command of the host's to stop behind what has arrived.
    void pretend_stop();

    /// Something other than keep-alives waits to be received, the loss of the link included.
    [[nodiscard]] bool has_command() const { return commands_ > 0 || is_lost_; }
    /// Poses or columns beyond those that the host has acknowledged.
    [[nodiscard]] std::uint32_t ahead() const { return has_sent_ ? sent_ - acknowledged_ : 0; }
    /// When the newest message of the host came.
    [[nodiscard]] std::int64_t heard_us() const { return heard_us_; }
    [[nodiscard]] std::uint64_t unsent() const { return unsent_; }

    /// A new stream begins: the host has not fallen behind yet.
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
    bool has_sent_ = false;           // anything of this stream
    std::uint32_t sent_ = 0;          // sequence after the newest one sent
    std::uint32_t acknowledged_ = 0;  // sequence after the newest one that the host has
    std::int64_t heard_us_ = 0;
    std::uint64_t unsent_ = 0;
};

}  // namespace tricoil::sim_front_end
