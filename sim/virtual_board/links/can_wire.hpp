// A CAN FD bus of 1 and 5 Mbit/s between the board and everybody else on it.
#pragma once

#include <deque>
#include <functional>
#include <optional>

#include "sim/virtual_board/peripherals/fdcan.hpp"

namespace tricoil::virtual_board {

class CanWire {
public:
    static constexpr double kNominalHz = 1e6;
    static constexpr double kDataHz = 5e6;

    CanWire(Machine& machine, Fdcan& board);

    /// Queued at the others' side; lower identifiers win the bus.
    void send(CanFrame frame);
    [[nodiscard]] std::size_t queued() const { return outgoing_.size(); }

    /// A frame that the board has sent.
    std::function<void(const CanFrame&)> on_frame;
    /// False: nobody acknowledges, as on an open bus.
    bool anybody_there = true;
    /// So many of the board's next frames are destroyed.
    unsigned destroy = 0;
    /// Somebody sends this frame without pause; none: no more.
    void babble_with(std::optional<CanFrame> frame);

private:
    void arbitrate();
    void frame_over();
    void check_timing(bool fast) const;
    void give(const CanFrame& frame);
    [[nodiscard]] static Ticks duration(const CanFrame& frame);

    Fdcan& board_;
    Event frame_over_;
    std::deque<CanFrame> outgoing_;
    CanFrame on_bus_;
    std::optional<CanFrame> babble_;
    enum class Sender : std::uint8_t { board, others, babbler } sender_ = Sender::board;
};

}  // namespace tricoil::virtual_board
