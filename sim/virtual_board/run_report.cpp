#include "sim/virtual_board/run_report.hpp"

namespace tricoil::virtual_board {

StackUse stack_use(VirtualBoard& board, std::uint32_t bottom, std::uint32_t top) {
    Memory& memory = board.machine.memory;
    const std::uint32_t paint = memory.word(bottom);
    std::uint32_t at = bottom;
    while (at < top && memory.word(at) == paint) {
        at += 4;
    }
    return {top - at, top - bottom};
}

WorstLatency worst_latency(const VirtualBoard& board) {
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
