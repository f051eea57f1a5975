// Segmentation of long messages for CAN FD frames of 64 bytes: ISO 15765-2 with normal addressing, compatible with the Linux
// kernel's CAN_ISOTP.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/can_mapping.hpp"

namespace tricoil::protocol {

/// Sends one message at a time. The caller sends each frame from next() and passes in received frames.
class Segmenter {
public:
    /// Starts a message of 65 to kMaxMessageBytes bytes. The message must stay valid until busy() is false. False for other
    /// lengths or if another message is being sent.
    bool begin(std::span<const std::uint8_t> message);

    /// Data of the next frame. Returns 0 if there is none now: the message is complete, or flow control is awaited.
    std::size_t next(std::span<std::uint8_t, kMaxFrameBytes> data);

    /// Frame from the receiver; ignored unless it is flow control. An overflow or an unknown flow status aborts the message.
    void on_flow_control(std::span<const std::uint8_t> data);

    void cancel() { *this = {}; }
    [[nodiscard]] bool busy() const { return at_ < message_.size(); }
    [[nodiscard]] bool waits() const { return busy() && window_ == 0; }
    /// Minimum time between frames, set by the receiver.
    [[nodiscard]] std::uint32_t gap_us() const { return gap_us_; }

private:
    std::span<const std::uint8_t> message_{};
    std::size_t at_ = 0;
    std::uint32_t window_ = 1;  // frames that may be sent before the next flow control
    std::uint32_t gap_us_ = 0;
    std::uint8_t serial_ = 0;
};

enum class SegmentEvent : std::uint8_t { none, answer, answer_anew, taken, complete, error };

/// Reassembles one message at a time in the buffer of BasicReassembler. A wrong sequence number or an invalid length drops the
/// message. A new first frame drops it too and starts the next message.
class ReassemblerBase {
public:
    ReassemblerBase(const ReassemblerBase&) = delete;
    ReassemblerBase& operator=(const ReassemblerBase&) = delete;

    /// answer: send flow_control(). answer_anew: the same; an incomplete message was dropped. taken: more segments follow.
    /// complete: message() is complete. error: the message was dropped.
    SegmentEvent on_frame(std::span<const std::uint8_t> data);

    /// Complete after `complete`, valid until the next frame.
    [[nodiscard]] std::span<const std::uint8_t> message() const { return {buffer_.data(), size_}; }
    [[nodiscard]] bool busy() const { return at_ < size_; }
    void cancel() { at_ = size_ = 0; }

    /// Clear to send: `window` frames before the next flow control, or all (0), without a minimum time between frames.
    static constexpr std::array<std::uint8_t, 3> flow_control(std::uint8_t window = 0) { return {0x30, window, 0}; }

protected:
    explicit ReassemblerBase(std::span<std::uint8_t> buffer) : buffer_(buffer) {}
    ~ReassemblerBase() = default;

private:
    SegmentEvent begin(std::span<const std::uint8_t> data);
    SegmentEvent go_on(std::span<const std::uint8_t> data);
    void append(std::span<const std::uint8_t> data);

    std::span<std::uint8_t> buffer_;
    std::size_t size_ = 0;
    std::size_t at_ = 0;
    std::uint8_t serial_ = 0;
};

/// For messages of at most `kBytes`. The first frame of a longer message is an error.
template <std::size_t kBytes>
class BasicReassembler final : public ReassemblerBase {
public:
    BasicReassembler() : ReassemblerBase(storage_) {}

private:
    std::array<std::uint8_t, kBytes> storage_{};
};

}  // namespace tricoil::protocol
