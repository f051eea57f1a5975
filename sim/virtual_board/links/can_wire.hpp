// A CAN FD bus of 1 and 5 Mbit/s between the board and all other nodes.
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

    /// Queues a frame of the other nodes; lower identifiers win arbitration.
    void send(CanFrame frame);
    [[nodiscard]] std::size_t queued() const { return outgoing_.size(); }

    /// Called with each frame that the board has sent.
    std::function<void(const CanFrame&)> on_frame;
    /// False: no node acknowledges, as on an open bus.
    bool has_other_nodes = true;
    /// Number of next frames of the board that are destroyed.
    unsigned frames_to_destroy = 0;
    /// Another node sends this frame continuously; std::nullopt stops it.
    void babble_with(std::optional<CanFrame> frame);

private:
    void arbitrate();
    void on_frame_end();
    void check_timing(bool fast) const;
    void deliver(const CanFrame& frame);
    [[nodiscard]] static Ticks duration(const CanFrame& frame);

    Fdcan& board_;
    Event frame_end_;
    std::deque<CanFrame> outgoing_;
    CanFrame on_bus_;
    std::optional<CanFrame> babble_;
    enum class Sender : std::uint8_t { board, others, babbler } sender_ = Sender::board;
};

}  // namespace tricoil::virtual_board
