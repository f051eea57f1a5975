// Faults of the board itself, by name. Faults of coils and sensor are those of sim/world.
#pragma once

#include <string>
#include <vector>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

/// NAME[:NUMBER][@BEGIN[-END]], times in seconds of simulated time. Without an end, a lasting fault stays until the
/// end of the run.
struct BoardFault {
    std::string name;
    unsigned number = 0;
    double begin_s = 0;
    double end_s = 0;
};

/// Applies each fault at its time.
class BoardFaults {
public:
    BoardFaults(VirtualBoard& board, std::vector<BoardFault> faults);
    /// Call between two calls of VirtualBoard::run_until().
    void update();

private:
    struct Planned {
        BoardFault fault;
        bool begun = false;
        bool ended = false;
        double next_s = 0;  // of repeated faults
    };
    void begin(Planned& planned);
    void repeat(Planned& planned);
    void end(const BoardFault& fault);

    VirtualBoard& board_;
    std::vector<Planned> planned_;
};

}  // namespace tricoil::virtual_board
