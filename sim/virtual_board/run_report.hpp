// What a run is judged by: load, latency, stack, and one number for everything the board has said.
#pragma once

#include <cstdint>
#include <string>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

/// FNV-1a over all that the board has sent, by link and order.
class OutputHash {
public:
    enum class Link : std::uint8_t { serial, can, usb };
    void add(Link link, std::span<const std::uint8_t> bytes) {
        mix(static_cast<std::uint8_t>(link));
        for (const std::uint8_t byte : bytes) {
            mix(byte);
        }
        bytes_ += bytes.size();
    }
    [[nodiscard]] std::uint64_t value() const { return hash_; }
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

private:
    void mix(std::uint8_t byte) { hash_ = (hash_ ^ byte) * 0x100000001B3; }
    std::uint64_t hash_ = 0xCBF29CE484222325;
    std::uint64_t bytes_ = 0;
};

struct StackUse {
    std::uint32_t used = 0;
    std::uint32_t size = 0;  // 0: the image's linker did not leave stack_bottom and stack_top
};
/// How much of its stack the image has overwritten, by the paint in it: the word that is at its very bottom.
StackUse stack_use(VirtualBoard& board, std::uint32_t bottom, std::uint32_t top);

struct WorstLatency {
    double seconds = 0;
    int interrupt = 0;  // negative: an exception of the processor, as SysTick -1
};
/// From an interrupt's request until its first instruction, over all interrupts.
WorstLatency worst_latency(const VirtualBoard& board);

/// Share of cycles in which the processor was not asleep, from one call to the next.
class LoadMeter {
public:
    explicit LoadMeter(const VirtualBoard& board) : board_(board) { take(); }
    double take();

private:
    const VirtualBoard& board_;
    std::uint64_t busy_ = 0;
    std::uint64_t cycles_ = 0;
};

}  // namespace tricoil::virtual_board
