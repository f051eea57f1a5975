// Long messages in segments over CAN FD frames of 64 bytes: ISO 15765-2 with normal addressing, as the kernel's CAN_ISOTP speaks
// it.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/can_mapping.hpp"

namespace tricoil::protocol {

/// Cuts one message at a time. The caller sends each frame that next() gives, and hands over the frames of the other direction.
class Segmenter {
public:
    /// Begins a message of 65 to kMaxMessageBytes bytes, which must stay where it is until done(); false for other lengths or
    /// while another message is under way.
    bool begin(std::span<const std::uint8_t> message);

    /// The next frame's data; 0 bytes if there is none now: done, or the receiver has to speak first.
    std::size_t next(std::span<std::uint8_t, kMaxFrameBytes> data);

    /// A frame from the receiver; ignored unless it is flow control. An overflow, or one out of place, ends the message.
    void on_flow_control(std::span<const std::uint8_t> data);

    void cancel() { *this = {}; }
    [[nodiscard]] bool busy() const { return at_ < message_.size(); }
    [[nodiscard]] bool waits() const { return busy() && window_ == 0; }
    /// Shortest time between frames that the receiver asked for.
    [[nodiscard]] std::uint32_t gap_us() const { return gap_us_; }

private:
    std::span<const std::uint8_t> message_{};
    std::size_t at_ = 0;
    std::uint32_t window_ = 1;  // frames that may still be sent before the receiver speaks
    std::uint32_t gap_us_ = 0;
    std::uint8_t serial_ = 0;
};

enum class SegmentEvent : std::uint8_t { none, answer, answer_anew, taken, complete, error };

/// Puts one message at a time together, in a buffer that BasicReassembler has. A wrong serial or a length out of range drops what
/// was there; so does another first frame, with which a new message begins.
class ReassemblerBase {
public:
    ReassemblerBase(const ReassemblerBase&) = delete;
    ReassemblerBase& operator=(const ReassemblerBase&) = delete;

    /// answer: send flow_control() to the sender; answer_anew: the same, and what was there has been dropped; taken: more is to
    /// come; complete: message() is whole; error: what was there has been dropped.
    SegmentEvent on_frame(std::span<const std::uint8_t> data);

    /// Whole after `complete`, until the next frame.
    [[nodiscard]] std::span<const std::uint8_t> message() const { return {buffer_.data(), size_}; }
    [[nodiscard]] bool busy() const { return at_ < size_; }
    void cancel() { at_ = size_ = 0; }

    /// Clear to send, `window` frames and then wait, or everything at once (0), as fast as you can.
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

/// Takes messages of at most `kBytes`; the first frame of a longer one is an error.
template <std::size_t kBytes>
class BasicReassembler final : public ReassemblerBase {
public:
    BasicReassembler() : ReassemblerBase(storage_) {}

private:
    std::array<std::uint8_t, kBytes> storage_{};
};
using Reassembler = BasicReassembler<kMaxMessageBytes>;

}  // namespace tricoil::protocol
