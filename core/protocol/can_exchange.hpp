// CAN FD transport of one node, for host or device: converts messages to frames and back, and segments long messages. The caller
// sends and receives the frames.
#pragma once

#include <algorithm>

#include "core/protocol/iso_tp.hpp"

namespace tricoil::protocol {

/// End of the link.
enum class CanSide : std::uint8_t { host, device };

/// Result of a received frame.
struct CanArrival {
    bool complete = false;  // a complete message was received
    WireError error = WireError::none;
};

/// kBytes: longest message. kWindow: segments that the sender may send before it waits for flow control; 0: all of them.
template <std::size_t kBytes, std::uint8_t kWindow = 0>
class CanExchange {
public:
    CanExchange(CanSide side, std::uint8_t node) : side_(side), node_(node) {}

    void reset() {
        segmenter_.cancel();
        reassembler_.cancel();
        owes_answer_ = false;
    }

    /// Identifier of the segments that the other end sends.
    [[nodiscard]] std::uint32_t incoming_segments() const {
        return can_id(side_ == CanSide::host ? kSegmentsFromDevice : kSegmentsFromHost, node_);
    }
    [[nodiscard]] std::uint8_t node() const { return node_; }
    void set_node(std::uint8_t node) { node_ = node; }

    /// Starts to send a message that is longer than a frame. The message is copied; send_due() sends it. False: the message is
    /// too long, or another one is being sent.
    bool begin(std::span<const std::uint8_t> message, std::int64_t now_us) {
        if (sending() || message.size() > kBytes) {
            return false;
        }
        std::copy(message.begin(), message.end(), outgoing_.begin());
        deadline_us_ = now_us + kSegmentTimeoutUs;
        next_segment_us_ = 0;
        return segmenter_.begin(std::span(outgoing_).first(message.size()));
    }
    [[nodiscard]] bool sending() const { return segmenter_.busy(); }
    /// Earliest time of the next segment. Invalid while waits().
    [[nodiscard]] std::int64_t next_segment_us() const { return next_segment_us_; }
    [[nodiscard]] bool waits() const { return segmenter_.waits(); }

    /// Call this often. It sends due frames: flow control and segments. send(frame) returns false if the frame must wait.
    /// bad_framing: the other end stopped in the middle of a message; the message is dropped.
    template <typename Send>
    WireError send_due(std::int64_t now_us, Send send) {
        owes_answer_ = owes_answer_ && !send(answer());
        const bool sender_is_silent = reassembler_.busy() && now_us > receive_deadline_us_;
        if (sender_is_silent) {
            reassembler_.cancel();
        }
        const bool receiver_is_silent = sending() && now_us > deadline_us_;
        if (receiver_is_silent) {
            segmenter_.cancel();
        }
        send_segments(now_us, send);
        return sender_is_silent || receiver_is_silent ? WireError::bad_framing : WireError::none;
    }

    /// Processes a frame of this node. `message` is valid until the next call. is_fd: false for a classic frame.
    template <typename Send>
    CanArrival take(const CanFrame& frame, bool is_fd, std::int64_t now_us, std::span<const std::uint8_t>& message, Send send) {
        if (frame.id == incoming_segments()) {
            return take_segment(frame, now_us, message, send);
        }
        const WireError error = is_fd || frame.length <= 8 ? from_frame(frame, message) : WireError::wrong_length;
        return {error == WireError::none, error};
    }

private:
    static constexpr std::int64_t kSegmentTimeoutUs = 1'000'000;  // ISO 15765-2: N_Bs and N_Cr

    [[nodiscard]] std::uint32_t outgoing_segments() const {
        return can_id(side_ == CanSide::host ? kSegmentsFromHost : kSegmentsFromDevice, node_);
    }

    template <typename Send>
    void send_segments(std::int64_t now_us, Send send) {
        CanFrame frame;
        frame.id = outgoing_segments();
        while (sending() && now_us >= next_segment_us_) {
            const Segmenter before = segmenter_;
            frame.length = static_cast<std::uint8_t>(segmenter_.next(frame.data));
            if (frame.length == 0) {
                break;
            }
            if (!send(frame)) {
                segmenter_ = before;  // try again later
                next_segment_us_ = now_us + 1000;
                break;
            }
            deadline_us_ = now_us + kSegmentTimeoutUs;
            next_segment_us_ = segmenter_.gap_us() > 0 ? now_us + segmenter_.gap_us() : 0;
        }
    }

    template <typename Send>
    CanArrival take_segment(const CanFrame& frame, std::int64_t now_us, std::span<const std::uint8_t>& message, Send send) {
        segmenter_.on_flow_control(frame.bytes());
        const SegmentEvent event = reassembler_.on_frame(frame.bytes());
        if (event != SegmentEvent::none && event != SegmentEvent::error) {
            receive_deadline_us_ = now_us + kSegmentTimeoutUs;
        }
        if (event == SegmentEvent::answer || event == SegmentEvent::answer_anew || window_is_over(event)) {
            segments_taken_ = 0;
            owes_answer_ = true;
        }
        const WireError silence = send_due(now_us, send);
        if (event == SegmentEvent::complete) {
            message = reassembler_.message();
            return {true, silence};
        }
        const bool dropped = event == SegmentEvent::error || event == SegmentEvent::answer_anew;
        return {false, dropped ? WireError::bad_framing : silence};
    }

    [[nodiscard]] CanFrame answer() const {
        const auto bytes = ReassemblerBase::flow_control(kWindow);
        CanFrame frame;
        frame.id = outgoing_segments();
        frame.length = static_cast<std::uint8_t>(bytes.size());
        std::copy(bytes.begin(), bytes.end(), frame.data.begin());
        return frame;
    }

    bool window_is_over(SegmentEvent event) {
        return kWindow > 0 && event == SegmentEvent::taken && ++segments_taken_ == kWindow;
    }

    CanSide side_;
    std::uint8_t node_;
    std::uint8_t segments_taken_ = 0;
    bool owes_answer_ = false;
    Segmenter segmenter_;
    BasicReassembler<kBytes> reassembler_;
    std::array<std::uint8_t, kBytes> outgoing_{};
    std::int64_t next_segment_us_ = 0;
    std::int64_t deadline_us_ = 0;          // for the answer to our segments
    std::int64_t receive_deadline_us_ = 0;  // for the next segment from the other end
};

}  // namespace tricoil::protocol
