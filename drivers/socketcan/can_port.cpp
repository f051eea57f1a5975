#include "drivers/socketcan/can_port.hpp"

#include <linux/can/error.h>

#include <algorithm>

#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/poll.hpp"

namespace tricoil::drivers {
namespace {

using protocol::CanFrame;

constexpr canid_t kExact = CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK;

}  // namespace

Status CanPort::do_open() {
    // The host receives the node's messages, the device those of the host: exact identifiers, standard data frames.
    std::array<can_filter, protocol::kMaxMessageType + 1> filters{};
    std::size_t count = 0;
    for (std::uint8_t type = 1; type <= protocol::kMaxMessageType; ++type) {
        const bool from_host = type == static_cast<std::uint8_t>(protocol::MessageType::command);
        if (from_host == (params_.side == CanSide::device)) {
            filters[count++] = {protocol::can_id(type, params_.node), kExact};
        }
    }
    filters[count++] = {exchange_.incoming_segments(), kExact};
    reason().clear();
    link_ = CanLink::up;
    dropped_seen_ = 0;
    return socket_.open(params_.interface, std::span(filters).first(count), reason());
}

void CanPort::do_close() {
    socket_.close();
    exchange_.reset();
}

Status CanPort::do_send(std::span<const std::uint8_t> message) {
    if (message.size() > protocol::kMaxMessageBytes) {
        return {StatusCode::invalid_argument, "message is too long"};
    }
    CanFrame frame;
    if (protocol::to_frame(message, params_.node, frame)) {
        return send_frame(frame);
    }
    if (exchange_.sending()) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "another long message is being sent"};
    }
    if (!exchange_.begin(message, to_us(host_now()))) {
        return {StatusCode::invalid_argument, "message is too short"};
    }
    send_segments();
    return {};
}

Status CanPort::send_frame(const CanFrame& frame) {
    if (link_ == CanLink::bus_off) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "CAN controller is bus-off"};
    }
    bool link_down = false;
    const Status status = socket_.send(frame, link_down);
    if (status.code() == StatusCode::device_lost) {
        return vanished();
    }
    if (!status.ok()) {
        ++counts().send_queue_full;
        set_link(link_down ? CanLink::down : link_);
    } else if (link_ == CanLink::down) {
        set_link(CanLink::up);
    }
    return status;
}

void CanPort::send_segments() {
    damaged().count(exchange_.send_due(to_us(host_now()), [this](const CanFrame& frame) { return send_frame(frame).ok(); }));
}

Status CanPort::do_receive(hal::ReceivedMessage& message) {
    for (;;) {
        const Status status = socket_.receive(reception_);
        if (status.code() == StatusCode::device_lost) {
            return vanished();
        }
        if (status.code() == StatusCode::timed_out) {
            set_link(CanLink::down);
            continue;  // the socket has reported its error; queued frames follow
        }
        send_segments();
        if (!status.ok()) {
            return status;
        }
        counts().receive_dropped += reception_.dropped - dropped_seen_;
        dropped_seen_ = reception_.dropped;
        if (reception_.is_error) {
            note_error_frame();
        } else if (take_frame(message)) {
            return {};
        }
    }
}

bool CanPort::take_frame(hal::ReceivedMessage& message) {
    set_link(CanLink::up);  // a received frame proves that the link is up
    const protocol::CanArrival arrival = exchange_.take(reception_.frame, reception_.is_fd, to_us(host_now()), message.bytes,
                                                        [this](const CanFrame& frame) { return send_frame(frame).ok(); });
    damaged().count(arrival.error);
    message.arrival = reception_.arrival;
    message.hardware_time_us = reception_.hardware_time_us;
    return arrival.complete;
}

Status CanPort::do_wait(Microseconds timeout) {
    const std::int64_t now = to_us(host_now());
    if (exchange_.sending() && !exchange_.waits()) {
        send_segments();
        const std::int64_t pause = std::max<std::int64_t>(exchange_.next_segment_us() - now, 100);
        timeout = exchange_.sending() ? std::min(timeout, Microseconds{pause}) : timeout;
    }
    return wait_readable(socket_.fd(), timeout);
}

void CanPort::note_error_frame() {
    if ((reception_.frame.id & CAN_ERR_BUSOFF) != 0) {
        set_link(CanLink::bus_off);
    } else if ((reception_.frame.id & CAN_ERR_RESTARTED) != 0) {
        set_link(CanLink::up);
    } else {
        ++counts().link_faults;
    }
}

void CanPort::set_link(CanLink link) {
    if (link == link_) {
        return;
    }
    link_ = link;
    if (link == CanLink::up) {
        reason().clear();
    } else if (link == CanLink::down) {
        ++counts().link_losses;
        reason().print("%s: link is down; bring it up: ip link set %s up", params_.interface.c_str(), params_.interface.c_str());
    } else {
        ++counts().link_faults;
        reason().print("%s: bus-off; check the wiring; for an automatic restart: ip link set %s type can restart-ms 100",
                       params_.interface.c_str(), params_.interface.c_str());
    }
}

Status CanPort::vanished() {
    counts().link_losses += socket_.is_open() ? 1U : 0U;  // once, also if a segment has found it first
    reason().print("%s: the interface is gone; plug the adapter in again", params_.interface.c_str());
    do_close();
    return {StatusCode::device_lost, "CAN interface is gone"};
}

}  // namespace tricoil::drivers
