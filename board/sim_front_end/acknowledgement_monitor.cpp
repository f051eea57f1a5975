#include "board/sim_front_end/acknowledgement_monitor.hpp"

#include <algorithm>
#include <utility>

#include "core/protocol/codec.hpp"

namespace tricoil::sim_front_end {

using protocol::Opcode;
using protocol::WireError;

void AcknowledgementMonitor::listen(HostTime now) {
    hal::ReceivedMessage message;
    Status status;
    while (is_open_ && !is_lost_ && (status = port_.receive(message)).ok()) {
        last_message_ = now;
        take({message.bytes.begin(), message.bytes.end()});
    }
    is_lost_ = is_lost_ || status.code() == StatusCode::device_lost;
}

void AcknowledgementMonitor::take(std::vector<std::uint8_t> bytes) {
    protocol::CommandMessage command;
    const bool is_keep_alive =
        protocol::decode(bytes, command) == WireError::none && static_cast<Opcode>(command.opcode) == Opcode::keep_alive;
    if (is_keep_alive) {  // its argument is the sequence number of the newest message that the host received; 0: none
        acknowledged_ = std::max(acknowledged_, std::min(command.argument + 1, sent_));
    }
    commands_ += is_keep_alive ? 0U : 1U;
    arrived_.push_back({std::move(bytes), !is_keep_alive});
}

void AcknowledgementMonitor::inject_stop() {
    protocol::CommandMessage command;
    command.opcode = static_cast<std::uint8_t>(Opcode::stop);
    std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
    bytes.resize(protocol::encode(command, bytes));
    take(std::move(bytes));
}

Status AcknowledgementMonitor::do_open() {
    is_open_ = is_open_ || port_.open().ok();
    return is_open_ ? Status{} : Status{StatusCode::device_lost, "the port cannot be opened"};
}

void AcknowledgementMonitor::do_close() {
    port_.close();
    is_open_ = false;
    is_lost_ = false;
    arrived_.clear();
    commands_ = 0;
}

Status AcknowledgementMonitor::do_send(std::span<const std::uint8_t> message) {
    const Status status = port_.send(message);
    unsent_ += status.ok() ? 0U : 1U;
    protocol::PoseMessage pose;
    protocol::ColumnMessage column;
    if (protocol::decode(message, pose) == WireError::none) {
        note_sent(pose.sequence);
    } else if (protocol::decode(message, column) == WireError::none) {
        note_sent(column.sequence);
    }
    return status;
}

void AcknowledgementMonitor::note_sent(std::uint32_t sequence) {
    if (!has_sent_ || sequence < sent_) {  // the pose counter restarts from 0
        acknowledged_ = sequence;
    }
    has_sent_ = true;
    sent_ = sequence + 1;
}

Status AcknowledgementMonitor::do_receive(hal::ReceivedMessage& message) {
    if (arrived_.empty()) {
        return is_lost_ ? Status{StatusCode::device_lost, "the link is gone"} : Status{StatusCode::not_ready, "none yet"};
    }
    taken_ = std::move(arrived_.front().bytes);
    commands_ -= arrived_.front().is_command ? 1U : 0U;
    arrived_.pop_front();
    message = {};
    message.bytes = taken_;
    return {};
}

}  // namespace tricoil::sim_front_end
