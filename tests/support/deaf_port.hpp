// A port without a peer.
#pragma once

#include <span>

#include "core/protocol/codec.hpp"
#include "hal/message_port.hpp"

namespace tricoil::test {

/// Accepts every message and receives none.
class DeafPort final : public hal::MessagePort {
public:
    /// The newest command sent through it.
    [[nodiscard]] const protocol::CommandMessage& command() const { return command_; }

private:
    Status do_open() override { return {}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> message) override {
        (void)protocol::decode(message, command_);  // other messages are ignored
        return {};
    }
    Status do_receive(hal::ReceivedMessage&) override { return {StatusCode::not_ready, ""}; }
    Status do_wait(Microseconds) override { return {}; }
    [[nodiscard]] const char* do_detail() const override { return ""; }

    protocol::CommandMessage command_;
};

}  // namespace tricoil::test
