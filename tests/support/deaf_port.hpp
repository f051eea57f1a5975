// A link behind which nobody is.
#pragma once

#include <span>

#include "core/protocol/codec.hpp"
#include "hal/message_port.hpp"

namespace tricoil::test {

/// Takes everything, gives nothing.
class DeafPort final : public hal::MessagePort {
public:
    /// The newest command that it was given.
    [[nodiscard]] const protocol::CommandMessage& command() const { return command_; }

private:
    Status do_open() override { return {}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> message) override {
        (void)protocol::decode(message, command_);  // whatever else is sent is forgotten
        return {};
    }
    Status do_receive(hal::ReceivedMessage&) override { return {StatusCode::not_ready, ""}; }
    Status do_wait(Microseconds) override { return {}; }
    [[nodiscard]] const char* do_detail() const override { return ""; }

    protocol::CommandMessage command_;
};

}  // namespace tricoil::test
