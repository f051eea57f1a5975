// Queue of framed messages from thread context to an interrupt handler.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/protocol/stream_framing.hpp"

namespace tricoil::stm32g4 {

/// A ring buffer in which messages are framed in place. One side pushes, the other pops; neither waits for the other.
template <std::size_t kBytes>
class FrameQueue {
public:
    /// Smallest capacity for messages of `bytes`.
    static constexpr std::size_t bytes_for(std::size_t bytes) { return protocol::framed_bytes(bytes) + 1; }

    /// False, without effect, if there is no room.
    bool push(std::span<const std::uint8_t> message) {
        const std::size_t out = out_.load(std::memory_order_acquire);
        const std::size_t in = in_.load(std::memory_order_relaxed);
        const std::size_t room =
            (out > in ? 0 : kBytes) + out - in - 1;  // one byte stays free, because a full ring would look like an empty one
        if (protocol::framed_bytes(message.size()) > room) {
            return false;
        }
        const std::size_t count =
            protocol::frame_through(message, [&](std::size_t at, std::uint8_t byte) { bytes_[wrapped(in + at)] = byte; });
        in_.store(static_cast<std::uint32_t>(wrapped(in + count)), std::memory_order_release);
        return true;
    }

    /// The next bytes to send, contiguous; empty if there are none.
    [[nodiscard]] std::span<const std::uint8_t> front() const {
        const std::size_t in = in_.load(std::memory_order_acquire);
        const std::size_t out = out_.load(std::memory_order_relaxed);
        return {bytes_.data() + out, (in >= out ? in : kBytes) - out};
    }

    /// Removes the first `count` bytes of front().
    void pop(std::size_t count) {
        const std::size_t out = out_.load(std::memory_order_relaxed);
        out_.store(static_cast<std::uint32_t>(wrapped(out + count)), std::memory_order_release);
    }

    /// Empties the queue; only for the popping side.
    void clear() { out_.store(in_.load(std::memory_order_acquire), std::memory_order_release); }

private:
    static constexpr std::size_t wrapped(std::size_t at) { return at < kBytes ? at : at - kBytes; }

    std::array<std::uint8_t, kBytes> bytes_{};
    std::atomic<std::uint32_t> in_{0};
    std::atomic<std::uint32_t> out_{0};
};

}  // namespace tricoil::stm32g4
