// Faults of the board itself. Faults of coils and sensor are those of sim/world.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

struct BoardFaultKind {
    const char* name;
    const char* help;  // name, ":N" if the fault has a number, and effect
    void (*begin)(VirtualBoard&, unsigned number);
    void (*end)(VirtualBoard&, unsigned number) = nullptr;  // null: nothing to do
    bool repeats = false;                                   // every `number` milliseconds
};
std::span<const BoardFaultKind> board_fault_kinds();

/// Times in seconds of simulated time. Without an end, a lasting fault stays until the end of the run.
struct BoardFault {
    const BoardFaultKind* kind = nullptr;
    unsigned number = 0;
    double begin_s = 0;
    double end_s = std::numeric_limits<double>::infinity();
};

/// Applies each fault at its time.
class BoardFaults {
public:
    BoardFaults(VirtualBoard& board, std::vector<BoardFault> faults) : board_(board), faults_(std::move(faults)) {}
    /// Call between two calls of VirtualBoard::run_until().
    void update();

private:
    VirtualBoard& board_;
    std::vector<BoardFault> faults_;  // begin_s: the next time
};

}  // namespace tricoil::virtual_board
