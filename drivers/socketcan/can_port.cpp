#include "drivers/socketcan/can_port.hpp"

#include <linux/can/error.h>

#include <algorithm>

#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/poll.hpp"

namespace tricoil::drivers {
namespace {

using protocol::CanFrame;
using protocol::WireError;

constexpr std::int64_t kSegmentTimeoutUs = 1'000'000;  // ISO 15765-2: N_Bs and N_Cr
constexpr canid_t kExact = CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_SFF_MASK;

constexpr std::uint8_t in_channel(CanSide side) {
    return side == CanSide::host ? protocol::kSegmentsFromDevice : protocol::kSegmentsFromHost;
}
constexpr std::uint8_t out_channel(CanSide side) {
    return side == CanSide::host ? protocol::kSegmentsFromHost : protocol::kSegmentsFromDevice;
}

}  // namespace

Status CanPort::do_open() {
    do_close();
    // The host hears the node's messages, the device the host's: exactly those identifiers, standard frames with data.
    std::array<can_filter, protocol::kMessageTypes + 1> filters{};
    std::size_t count = 0;
    for (std::uint8_t type = 1; type <= protocol::kMessageTypes; ++type) {
        const bool from_host = type == static_cast<std::uint8_t>(protocol::MessageType::command);
        if (from_host == (params_.side == CanSide::device)) {
            filters[count++] = {protocol::can_id(type, params_.node), kExact};
        }
    }
    filters[count++] = {protocol::can_id(in_channel(params_.side), params_.node), kExact};
    why().clear();
    link_ = CanLink::up;
    dropped_seen_ = 0;
    return socket_.open(params_.interface, std::span(filters).first(count), why());
}

void CanPort::do_close() {
    socket_.close();
    segmenter_.cancel();
    reassembler_.cancel();
}

Status CanPort::do_send(std::span<const std::uint8_t> message) {
    if (!socket_.is_open()) {
        return {StatusCode::device_lost, "CAN port is closed"};
    }
    if (message.size() > protocol::kMaxMessageBytes) {
        return {StatusCode::invalid_argument, "message is longer than any may be"};
    }
    CanFrame frame;
    if (protocol::to_frame(message, params_.node, frame)) {
        const Status status = send_frame(frame);
        counts().sent += status.ok() ? 1U : 0U;
        return status;
    }
    if (segmenter_.busy()) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "another long message is under way"};
    }
    std::copy(message.begin(), message.end(), outgoing_.begin());
    if (!segmenter_.begin(std::span(outgoing_).first(message.size()))) {
        return {StatusCode::invalid_argument, "no message"};
    }
    segment_deadline_us_ = monotonic_us() + kSegmentTimeoutUs;
    next_segment_us_ = 0;
    send_segments();
    ++counts().sent;
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
    if (!segmenter_.busy()) {
        return;
    }
    const std::int64_t now = monotonic_us();
    if (now > segment_deadline_us_) {
        segmenter_.cancel();
        damaged().count(WireError::bad_framing);
        return;
    }
    CanFrame frame;
    while (now >= next_segment_us_) {
        const protocol::Segmenter before = segmenter_;
        frame.length = static_cast<std::uint8_t>(segmenter_.next(frame.data));
        if (frame.length == 0) {
            return;
        }
        frame.id = protocol::can_id(out_channel(params_.side), params_.node);
        if (!send_frame(frame).ok()) {
            segmenter_ = before;  // once more, when there is room
            next_segment_us_ = now + 1000;
            return;
        }
        segment_deadline_us_ = now + kSegmentTimeoutUs;
        next_segment_us_ = segmenter_.gap_us() > 0 ? now + segmenter_.gap_us() : 0;
    }
}

Status CanPort::do_receive(hal::ReceivedMessage& message) {
    if (!socket_.is_open()) {
        return {StatusCode::device_lost, "CAN port is closed"};
    }
    for (;;) {
        const Status status = socket_.receive(reception_);
        if (status.code() == StatusCode::device_lost) {
            return vanished();
        }
        if (status.code() == StatusCode::timed_out) {
            set_link(CanLink::down);
            continue;  // the socket has told its error; what is queued comes next
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
            ++counts().received;
            return {};
        }
    }
}

bool CanPort::take_frame(hal::ReceivedMessage& message) {
    set_link(CanLink::up);  // whoever receives is on the bus
    if (protocol::channel_of(reception_.frame.id) == in_channel(params_.side)) {
        return take_segment(message);
    }
    const WireError error = reception_.is_fd || reception_.frame.length <= 8
                                ? protocol::from_frame(reception_.frame, message.bytes)
                                : WireError::wrong_length;
    damaged().count(error);
    message.host_time_us = reception_.host_time_us;
    message.hardware_time_us = reception_.hardware_time_us;
    return error == WireError::none;
}

bool CanPort::take_segment(hal::ReceivedMessage& message) {
    segmenter_.on_flow_control(reception_.frame.bytes());
    send_segments();
    const protocol::SegmentEvent event = reassembler_.on_frame(reception_.frame.bytes());
    if (event == protocol::SegmentEvent::answer) {
        CanFrame frame;
        const auto flow = protocol::Reassembler::flow_control();
        std::copy(flow.begin(), flow.end(), frame.data.begin());
        frame.id = protocol::can_id(out_channel(params_.side), params_.node);
        frame.length = static_cast<std::uint8_t>(flow.size());
        (void)send_frame(frame);  // unsent: the sender gives up and the message counts as lost
    } else if (event == protocol::SegmentEvent::error) {
        damaged().count(WireError::bad_framing);
    } else if (event == protocol::SegmentEvent::complete) {
        message = {reassembler_.message(), reception_.host_time_us, reception_.hardware_time_us};
        return true;
    }
    return false;
}

Status CanPort::do_wait(Microseconds timeout) {
    if (!socket_.is_open()) {
        return {StatusCode::device_lost, "CAN port is closed"};
    }
    const std::int64_t now = monotonic_us();
    if (segmenter_.busy() && !segmenter_.waits()) {
        send_segments();
        const std::int64_t pause = std::max<std::int64_t>(next_segment_us_ - now, 100);
        timeout = segmenter_.busy() ? std::min(timeout, Microseconds{pause}) : timeout;
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
        why().clear();
    } else if (link == CanLink::down) {
        ++counts().link_losses;
        why().print("%s: link is down; bring it up: ip link set %s up", params_.interface.c_str(), params_.interface.c_str());
    } else {
        ++counts().link_faults;
        why().print("%s: bus-off; check the wiring; the kernel restarts by itself with: ip link set %s type can restart-ms 100",
                    params_.interface.c_str(), params_.interface.c_str());
    }
}

Status CanPort::vanished() {
    ++counts().link_losses;
    why().print("%s: the interface is gone; plug it in again", params_.interface.c_str());
    do_close();
    return {StatusCode::device_lost, "CAN interface is gone"};
}

}  // namespace tricoil::drivers
