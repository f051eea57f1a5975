// Figures of a run: load, latency, stack, and a hash of all output.
#pragma once

#include <cstdint>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

/// FNV-1a hash over all output of the board, with its link and in its order.
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
    std::uint32_t size = 0;  // 0: the image has no symbols stack_bottom and stack_top
};
/// Stack use: the words overwritten since start-up. Unused words hold the paint value, which is read from the lowest word.
inline StackUse stack_use(VirtualBoard& board, std::uint32_t bottom, std::uint32_t top) {
    Memory& memory = board.machine.memory;
    const std::uint32_t paint = memory.word(bottom);
    std::uint32_t at = bottom;
    while (at < top && memory.word(at) == paint) {
        at += 4;
    }
    return {top - at, top - bottom};
}

struct WorstLatency {
    double seconds = 0;
    int interrupt = 0;  // negative: an exception of the processor; SysTick is -1
};
/// Longest time from an interrupt request to the first instruction of the handler, over all interrupts.
inline WorstLatency worst_latency(const VirtualBoard& board) {
    WorstLatency worst;
    const auto& latencies = board.machine.nvic.latencies();
    for (std::size_t e = 0; e < latencies.size(); ++e) {
        const double waited = seconds(latencies[e].worst);
        if (latencies[e].entries > 0 && waited > worst.seconds) {
            worst = {waited, static_cast<int>(e) - kFirstInterrupt};
        }
    }
    return worst;
}

}  // namespace tricoil::virtual_board
