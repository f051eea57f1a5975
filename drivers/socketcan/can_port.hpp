// Protocol messages over the identifiers of one node on a CAN FD interface.
#pragma once

#include <cstdint>
#include <string>

#include "core/protocol/can_exchange.hpp"
#include "drivers/posix/reporting_port.hpp"
#include "drivers/socketcan/can_socket.hpp"

namespace tricoil::drivers {

using protocol::CanSide;

struct CanPortParams {
    std::string interface = "can0";
    std::uint8_t node = 0;  // 0-15
    CanSide side = CanSide::host;
};

/// Link states. The port returns to `up` without a new open().
enum class CanLink : std::uint8_t { up, down, bus_off };

/// Long messages are sent in segments during wait() and receive(). A faulty segment drops its message and is counted as bad
/// framing.
class CanPort final : public ReportingPort {
public:
    explicit CanPort(CanPortParams params) : params_(std::move(params)), exchange_(params_.side, params_.node) {}

    [[nodiscard]] CanLink link() const { return link_; }

private:
    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override;

    Status send_frame(const protocol::CanFrame& frame);
    void send_segments();
    bool take_frame(hal::ReceivedMessage& message);
    void note_error_frame();
    void set_link(CanLink link);
    Status vanished();

    CanPortParams params_;
    CanSocket socket_;
    CanReception reception_;
    protocol::CanExchange<protocol::kMaxMessageBytes> exchange_;
    std::uint32_t dropped_seen_ = 0;
    CanLink link_ = CanLink::up;
};

}  // namespace tricoil::drivers
