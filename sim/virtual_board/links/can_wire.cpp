#include "sim/virtual_board/links/can_wire.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace tricoil::virtual_board {
namespace {

constexpr double kTolerance = 2e-3;

void check_rate(double hz, double bus_hz, const char* phase) {
    if (!(std::abs(hz / bus_hz - 1) < kTolerance)) {
        throw RunFailure(fmt::format("FDCAN's {} phase runs at {:.0f} bit/s, the bus at {:.0f}", phase, hz, bus_hz));
    }
}

/// Arbitration order: a standard frame wins over an extended frame with the same first eleven bits.
std::uint64_t rank(const CanFrame& frame) {
    return frame.extended ? std::uint64_t{frame.id} << 1U | 1U : std::uint64_t{frame.id} << 19U;
}

}  // namespace

CanWire::CanWire(Machine& machine, Fdcan& board) : board_(board), frame_end_(machine.events, [this] { on_frame_end(); }) {
    board.on_request = [this] { arbitrate(); };
}

/// ISO 11898-1: bits of each phase, plus 10 % for stuffing.
Ticks CanWire::duration(const CanFrame& frame) {
    const double bytes = static_cast<double>(frame.data.size());
    const double slow = (frame.extended ? 52 : 32) + 13;
    const double data = 8 * bytes + (frame.fd ? (bytes > 16 ? 35 : 31) : 20);
    return ticks(1.1 * (slow / kNominalHz + data / (frame.fast ? kDataHz : kNominalHz)));
}

void CanWire::send(CanFrame frame) {
    outgoing_.push_back(std::move(frame));
    arbitrate();
}

void CanWire::babble_with(std::optional<CanFrame> frame) {
    babble_ = std::move(frame);
    arbitrate();
}

void CanWire::arbitrate() {
    if (frame_end_.is_due()) {
        return;
    }
    const auto own = board_.waiting();
    std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
    const auto offer = [&](const CanFrame& frame, Sender sender) {
        if (rank(frame) < best) {
            best = rank(frame);
            on_bus_ = frame;
            sender_ = sender;
        }
    };
    if (own) {
        check_timing(own->fast);
        if (own->fast && board_.compensation_offset() != board_.data_sample_point()) {
            throw RunFailure("FDCAN's TDCR.TDCO differs from the sample point of the data phase");
        }
        offer(*own, Sender::board);
    }
    if (!outgoing_.empty()) {
        offer(outgoing_.front(), Sender::others);
    }
    if (babble_) {
        offer(*babble_, Sender::babbler);
    }
    if (best != std::numeric_limits<std::uint64_t>::max()) {
        frame_end_.in(duration(on_bus_));
    }
}

/// Checks the bit rates of a controller that receives or sends.
void CanWire::check_timing(bool fast) const {
    check_rate(board_.nominal_hz(), kNominalHz, "arbitration");
    check_rate(fast ? board_.data_hz() : kDataHz, kDataHz, "data");
}

void CanWire::deliver(const CanFrame& frame) {
    if (board_.is_on()) {
        check_timing(frame.fast);
    }
    board_.receive(frame);
}

void CanWire::on_frame_end() {
    switch (sender_) {
        case Sender::board:
            if (frames_to_destroy > 0) {
                --frames_to_destroy;
                board_.bus_error(true);
            } else {
                board_.sent(has_other_nodes);
                if (has_other_nodes && on_frame) {
                    on_frame(on_bus_);
                }
            }
            break;
        case Sender::others:
            deliver(on_bus_);
            outgoing_.pop_front();
            break;
        case Sender::babbler:
            deliver(on_bus_);
            break;
    }
    arbitrate();
}

}  // namespace tricoil::virtual_board
