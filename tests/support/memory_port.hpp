// Two directly connected ports in memory.
#pragma once

#include <deque>
#include <vector>

#include "hal/message_port.hpp"

namespace tricoil::sim {

/// A message sent at one end is received at the other, complete and in order; at most `room` messages wait. The ports
/// simulate no other errors.
class MemoryPort final : public hal::MessagePort {
public:
    explicit MemoryPort(std::size_t room = 64) : room_(room) {}
    /// Both ports must exist while either is used.
    void connect(MemoryPort& other) {
        other_ = &other;
        other.other_ = this;
    }
    /// Disconnects: both ends return device_lost, and cannot be opened until plug_in().
    void unplug() { is_plugged_ = false; }
    void plug_in() { is_plugged_ = true; }

private:
    using Bytes = std::vector<std::uint8_t>;

    [[nodiscard]] bool is_there() const { return is_plugged_ && other_->is_plugged_; }
    Status do_open() override {
        arrived_.clear();
        return is_there() ? Status{} : lost();
    }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> message) override {
        if (!is_there()) {
            return lost();
        }
        if (message.size() > kLongest) {
            return {StatusCode::invalid_argument, "too long"};
        }
        if (!other_->is_open() || other_->arrived_.size() >= other_->room_) {
            ++counts().send_queue_full;
            return {StatusCode::not_ready, "no room"};
        }
        other_->arrived_.emplace_back(message.begin(), message.end());
        return {};
    }
    Status do_receive(hal::ReceivedMessage& message) override {
        if (!is_there()) {
            return lost();
        }
        if (arrived_.empty()) {
            return {StatusCode::not_ready, ""};
        }
        taken_ = std::move(arrived_.front());
        arrived_.pop_front();
        message = {taken_, HostTime{}, 0};
        return {};
    }
    Status do_wait(Microseconds) override { return arrived_.empty() ? Status{StatusCode::timed_out, ""} : Status{}; }
    [[nodiscard]] const char* do_detail() const override { return is_there() ? "" : "pulled out"; }

    static Status lost() { return {StatusCode::device_lost, "pulled out"}; }

    static constexpr std::size_t kLongest = 4095;
    std::size_t room_;
    MemoryPort* other_ = this;
    std::deque<Bytes> arrived_;
    Bytes taken_;
    bool is_plugged_ = true;
};

}  // namespace tricoil::sim
