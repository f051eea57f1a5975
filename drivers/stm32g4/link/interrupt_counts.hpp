// Event counters that an interrupt handler increments and thread context reads.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/message_port.hpp"

namespace tricoil::stm32g4 {

/// Only one interrupt handler increments the counters. 32-bit counters are read atomically, unlike a port's own 64-bit counters.
class InterruptCounts {
public:
    void note_fault() { increase(faults_); }
    void note_dropped() { increase(dropped_); }
    void note_loss() { increase(losses_); }

    /// Thread context.
    void copy_to(hal::PortCounters& counters) const {
        counters.link_faults = faults_.load(std::memory_order_relaxed);
        counters.receive_dropped = dropped_.load(std::memory_order_relaxed);
        counters.link_losses = losses_.load(std::memory_order_relaxed);
    }

private:
    static void increase(std::atomic<std::uint32_t>& count) {
        count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }

    std::atomic<std::uint32_t> faults_{0};
    std::atomic<std::uint32_t> dropped_{0};
    std::atomic<std::uint32_t> losses_{0};
};

}  // namespace tricoil::stm32g4
