// Ring buffer for bytes or frames between an interrupt handler and thread context.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

/// One side pushes, the other pops; neither waits for the other.
template <typename Item, std::size_t kItems>
class Ring {
    static_assert((kItems & (kItems - 1)) == 0, "kItems must be a power of two, so that indices may wrap around");

public:
    /// False if it is full.
    bool push(const Item& item) {
        const std::uint32_t in = in_.load(std::memory_order_relaxed);
        if (in - out_.load(std::memory_order_acquire) == kItems) {
            return false;
        }
        items_[in % kItems] = item;
        in_.store(in + 1, std::memory_order_release);
        return true;
    }

    /// False if it is empty.
    bool pop(Item& item) {
        const std::uint32_t out = out_.load(std::memory_order_relaxed);
        if (in_.load(std::memory_order_acquire) == out) {
            return false;
        }
        item = items_[out % kItems];
        out_.store(out + 1, std::memory_order_release);
        return true;
    }

    [[nodiscard]] std::size_t size() const { return in_.load(std::memory_order_acquire) - out_.load(std::memory_order_acquire); }
    [[nodiscard]] std::size_t room() const { return kItems - size(); }

    /// Empties the ring; only for the popping side.
    void clear() { out_.store(in_.load(std::memory_order_acquire), std::memory_order_release); }

private:
    std::array<Item, kItems> items_{};
    std::atomic<std::uint32_t> in_{0};
    std::atomic<std::uint32_t> out_{0};
};

}  // namespace tricoil::stm32g4
