// A CAN FD bus between the controllers of the board and all other nodes.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "sim/virtual_board/peripherals/fdcan.hpp"

namespace tricoil::virtual_board {

class CanWire {
public:
    /// Bit rates in bit/s.
    struct Rates {
        double nominal_hz = 1e6;
        double data_hz = 5e6;
    };

    CanWire(Machine& machine, std::vector<Fdcan*> controllers);

    /// Bit rates of the other nodes.
    void set_rates(const Rates& rates) { rates_ = rates; }
    /// Queues a frame of the other nodes; lower identifiers win arbitration.
    void send(CanFrame frame);
    [[nodiscard]] std::size_t queued() const { return outgoing_.size(); }

    /// Called with each frame that the board has sent.
    std::function<void(const CanFrame&)> on_frame;
    /// False: no other node acknowledges, as on an open bus.
    bool has_other_nodes = true;
    /// Number of next frames of the board that are destroyed.
    unsigned frames_to_destroy = 0;
    /// Another node sends this frame continuously; std::nullopt stops it.
    void babble_with(std::optional<CanFrame> frame);

private:
    void arbitrate();
    void on_frame_end();
    void finish_own();
    void check_own(const Fdcan& controller, const CanFrame& frame) const;
    void check_timing(const Fdcan& controller, bool fast) const;
    void deliver(const CanFrame& frame, const Fdcan* sender);
    [[nodiscard]] bool is_acknowledged() const;

    std::vector<Fdcan*> controllers_;
    Rates rates_;
    Event frame_end_;
    std::deque<CanFrame> outgoing_;
    CanFrame on_bus_;
    std::optional<CanFrame> babble_;
    enum class Sender : std::uint8_t { board, others, babbler } sender_ = Sender::board;
    Fdcan* own_sender_ = nullptr;  // if sender_ is the board
};

}  // namespace tricoil::virtual_board
