// Common part of the device-side ports: the queue of received messages and the text of the last problem.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "hal/message_port.hpp"

namespace tricoil::sim {

class PeerPort : public hal::MessagePort {
protected:
    void arrived(std::span<const std::uint8_t> message) { messages_.emplace_back(message.begin(), message.end()); }
    [[nodiscard]] bool any_arrived() const { return !messages_.empty(); }
    void forget_arrived() { messages_.clear(); }

    /// The oldest received message. ok; not_ready: none.
    Status take_arrived(hal::ReceivedMessage& message) {
        if (messages_.empty()) {
            return {StatusCode::not_ready, "no message"};
        }
        message_ = std::move(messages_.front());
        messages_.pop_front();
        message = {message_, HostTime{}, 0};
        return {};
    }

    /// The text of detail().
    [[nodiscard]] std::string& reason() { return reason_; }

private:
    [[nodiscard]] const char* do_detail() const final { return reason_.c_str(); }

    std::deque<std::vector<std::uint8_t>> messages_;
    std::vector<std::uint8_t> message_;  // newest message that take_arrived() returned
    std::string reason_;
};

}  // namespace tricoil::sim
