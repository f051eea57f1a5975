// Framed messages on their way out, from thread context to an interrupt handler.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/protocol/stream_framing.hpp"

namespace tricoil::stm32g4 {

/// Each message lies in one piece, so that it is framed in place: where the end of the buffer is too near it begins again at the
/// front. One side pushes, the other takes; neither waits for the other.
template <std::size_t kBytes>
class FrameQueue {
public:
    /// Least capacity of a queue that, when empty, takes a message of `bytes` wherever the last one ended.
    static constexpr std::size_t bytes_for(std::size_t bytes) { return 2 * protocol::framed_bytes(bytes) + 1; }

    /// False, and nothing changes, if there is no room.
    bool push(std::span<const std::uint8_t> message) {
        const std::uint32_t out = out_.load(std::memory_order_acquire);
        const std::uint32_t in = in_.load(std::memory_order_relaxed);
        const std::size_t need = protocol::framed_bytes(message.size());
        const bool is_split = in < out;  // the waiting bytes go on at the front
        if (is_split ? out - in > need : kBytes - in >= need) {
            in_.store(write(message, in), std::memory_order_release);
            return true;
        }
        if (is_split || out <= need) {
            return false;
        }
        const std::uint32_t end = write(message, 0);
        turn_.store(in, std::memory_order_relaxed);
        in_.store(end, std::memory_order_release);
        return true;
    }

    /// What goes out next, in one piece; empty if nothing waits.
    [[nodiscard]] std::span<const std::uint8_t> front() const {
        const std::uint32_t in = in_.load(std::memory_order_acquire);
        const std::uint32_t out = out_.load(std::memory_order_relaxed);
        if (in >= out) {
            return {bytes_.data() + out, in - out};
        }
        const std::uint32_t turn = turn_.load(std::memory_order_relaxed);
        return out == turn ? std::span{bytes_.data(), in} : std::span{bytes_.data() + out, turn - out};
    }

    /// The first `count` bytes of front() are gone.
    void pop(std::size_t count) {
        const std::uint32_t in = in_.load(std::memory_order_acquire);
        const std::uint32_t out = out_.load(std::memory_order_relaxed);
        const bool at_turn = in < out && out == turn_.load(std::memory_order_relaxed);
        out_.store(static_cast<std::uint32_t>((at_turn ? 0 : out) + count), std::memory_order_release);
    }

    /// Forgets everything; by the side that takes.
    void clear() { out_.store(in_.load(std::memory_order_acquire), std::memory_order_release); }

private:
    std::uint32_t write(std::span<const std::uint8_t> message, std::uint32_t at) {
        return static_cast<std::uint32_t>(at + protocol::frame(message, std::span(bytes_).subspan(at)));
    }

    std::array<std::uint8_t, kBytes> bytes_{};
    std::atomic<std::uint32_t> in_{0};
    std::atomic<std::uint32_t> out_{0};
    std::atomic<std::uint32_t> turn_{0};  // where the waiting bytes break off to go on at the front
};

}  // namespace tricoil::stm32g4
