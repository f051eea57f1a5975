// One end of one node's conversation over CAN FD: messages to frames and back, long ones in segments. Whoever has the bus sends
// and receives the frames.
#pragma once

#include <algorithm>

#include "core/protocol/iso_tp.hpp"

namespace tricoil::protocol {

/// Which end of the conversation.
enum class CanSide : std::uint8_t { host, device };

/// What became of a frame.
struct CanArrival {
    bool complete = false;  // a message is there
    WireError error = WireError::none;
};

/// kBytes: longest message. kWindow: segments that the sender may send before it waits for us; 0: all of them.
template <std::size_t kBytes, std::uint8_t kWindow = 0>
class CanExchange {
public:
    CanExchange(CanSide side, std::uint8_t node) : side_(side), node_(node) {}

    void reset() {
        segmenter_.cancel();
        reassembler_.cancel();
        owes_answer_ = false;
    }

    /// Segments that the other end sends come under this identifier.
    [[nodiscard]] std::uint32_t incoming_segments() const {
        return can_id(side_ == CanSide::host ? kSegmentsFromDevice : kSegmentsFromHost, node_);
    }
    [[nodiscard]] std::uint8_t node() const { return node_; }

    /// Begins to send a message that is longer than a frame, and copies it; go_on() sends it. False: too long, or sending() one.
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
    /// A segment may be sent from this time on; meaningless while waits().
    [[nodiscard]] std::int64_t next_segment_us() const { return next_segment_us_; }
    [[nodiscard]] bool waits() const { return segmenter_.waits(); }

    /// Call it often: sends what may go now, the answer to a sender that waits, and segments; send(frame) is false if the frame
    /// must wait. bad_framing: the other end fell silent in the middle of a message, which is dropped.
    template <typename Send>
    WireError go_on(std::int64_t now_us, Send send) {
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

    /// Takes a frame of this node; `message` is valid until the next one. is_fd: not a classic frame.
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
                segmenter_ = before;  // once more, when there is room
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
        const WireError silence = go_on(now_us, send);
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
    std::int64_t deadline_us_ = 0;          // for the receiver of what we send
    std::int64_t receive_deadline_us_ = 0;  // for the sender of what we receive
};

}  // namespace tricoil::protocol
