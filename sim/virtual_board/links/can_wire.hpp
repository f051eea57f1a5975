// A CAN FD bus between the controllers of the board and all other nodes.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
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

    CanWire(Machine& machine, std::vector<Fdcan*> controllers)
        : controllers_(std::move(controllers)),
          frame_end_(
              machine.events, [this] { on_frame_end(); }, Event::Clock::always) {
        for (Fdcan* controller : controllers_) {
            controller->on_request = [this] { arbitrate(); };
            controller->on_loop = [this](const CanFrame& frame) {  // no other controller listens meanwhile
                if (has_other_nodes && on_frame) {
                    on_frame(frame);
                }
            };
        }
    }

    /// Bit rates of the other nodes.
    void set_rates(const Rates& rates) { rates_ = rates; }
    /// Queues a frame of the other nodes; lower identifiers win arbitration.
    void send(CanFrame frame) {
        outgoing_.push_back(std::move(frame));
        arbitrate();
    }
    [[nodiscard]] std::size_t queued() const { return outgoing_.size(); }

    /// Called with each frame that the board has sent.
    std::function<void(const CanFrame&)> on_frame;
    /// False: no other node acknowledges, as on an open bus.
    bool has_other_nodes = true;
    /// Number of next frames of the board that are destroyed.
    unsigned frames_to_destroy = 0;
    /// Another node sends this frame continuously; std::nullopt stops it.
    void babble_with(std::optional<CanFrame> frame) {
        babble_ = std::move(frame);
        arbitrate();
    }

private:
    static constexpr double kTolerance = 2e-3;
    static void check_rate(double hz, double bus_hz, const char* phase) {
        fail_if(!(std::abs(hz / bus_hz - 1) < kTolerance), "FDCAN's {} phase runs at {:.0f} bit/s, the bus at {:.0f}", phase, hz,
                bus_hz);
    }
    /// Arbitration order: a standard frame wins over an extended frame with the same first eleven bits, a data frame over a
    /// remote frame with the same identifier.
    static std::uint64_t rank(const CanFrame& frame) {
        const std::uint64_t id = frame.extended ? std::uint64_t{frame.id} << 1U | 1U : std::uint64_t{frame.id} << 19U;
        return id << 1U | (frame.remote ? 1U : 0U);
    }

    void arbitrate() {
        if (frame_end_.is_due()) {
            return;
        }
        std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
        own_sender_ = nullptr;
        const auto offer = [&](const CanFrame& frame, Sender sender, Fdcan* own = nullptr) {
            if (rank(frame) < best) {
                best = rank(frame);
                on_bus_ = frame;
                sender_ = sender;
                own_sender_ = own;
            }
        };
        for (Fdcan* controller : controllers_) {
            if (const auto own = controller->waiting()) {
                check_own(*controller, *own);
                offer(*own, Sender::board, controller);
            }
        }
        if (!outgoing_.empty()) {
            offer(outgoing_.front(), Sender::others);
        }
        if (babble_) {
            offer(*babble_, Sender::babbler);
        }
        if (best != std::numeric_limits<std::uint64_t>::max()) {
            frame_end_.in(frame_time(on_bus_, rates_.nominal_hz, rates_.data_hz));
            if (own_sender_ != nullptr) {
                own_sender_->win_arbitration();
            }
        }
    }
    void on_frame_end() {
        const Sender sender = sender_;  // a receiver may send the next frame at once
        if (sender == Sender::board) {
            finish_own();
        } else {
            deliver(on_bus_, nullptr);
        }
        if (sender == Sender::others) {
            outgoing_.pop_front();
        }
        arbitrate();
    }
    void finish_own() {
        Fdcan& sender = *own_sender_;
        if (frames_to_destroy > 0) {
            --frames_to_destroy;
            sender.bus_error(true);
            return;
        }
        const bool acknowledged = is_acknowledged();
        sender.sent(acknowledged);
        if (acknowledged) {
            deliver(on_bus_, &sender);
        }
        if (has_other_nodes && on_frame) {
            on_frame(on_bus_);
        }
    }
    void check_own(const Fdcan& controller, const CanFrame& frame) const {
        check_timing(controller, frame.fast);
        fail_if(
            frame.fast && controller.compensates_delay() && controller.compensation_offset() != controller.data_sample_point(),
            "FDCAN's TDCR.TDCO differs from the sample point of the data phase");
    }
    /// Checks the bit rates of a controller that receives or sends.
    void check_timing(const Fdcan& controller, bool fast) const {
        check_rate(controller.nominal_hz(), rates_.nominal_hz, "arbitration");
        if (fast) {
            check_rate(controller.data_hz(), rates_.data_hz, "data");
        }
    }
    void deliver(const CanFrame& frame, const Fdcan* sender) {
        for (Fdcan* controller : controllers_) {
            if (controller != sender && controller->is_on()) {
                check_timing(*controller, frame.fast);
                controller->receive(frame);
            }
        }
    }
    [[nodiscard]] bool is_acknowledged() const {
        return has_other_nodes || std::any_of(controllers_.begin(), controllers_.end(), [this](const Fdcan* controller) {
                   return controller != own_sender_ && controller->acknowledges();
               });
    }

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
