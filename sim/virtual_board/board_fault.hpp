// What can break on the board itself, by name; what breaks in front of it are the faults of sim/world.
#pragma once

#include <string>
#include <vector>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

/// NAME[:NUMBER][@BEGIN[-END]], times in seconds of simulated time. Without an end it stays, or happens once.
struct BoardFault {
    std::string name;
    unsigned number = 0;
    double begin_s = 0;
    double end_s = 0;
};

/// Does them as their time comes.
class BoardFaults {
public:
    BoardFaults(VirtualBoard& board, std::vector<BoardFault> faults);
    /// Call between two runs of the board.
    void look();

private:
    struct Planned {
        BoardFault fault;
        bool begun = false;
        bool ended = false;
        double next_s = 0;  // of those that repeat
    };
    void begin(Planned& planned);
    void repeat(Planned& planned);
    void end(const BoardFault& fault);

    VirtualBoard& board_;
    std::vector<Planned> planned_;
};

}  // namespace tricoil::virtual_board
