// A link behind which nobody is.
#pragma once

#include "hal/message_port.hpp"

namespace tricoil::test {

/// Takes everything, gives nothing.
class DeafPort final : public hal::MessagePort {
    Status do_open() override { return {}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t>) override { return {}; }
    Status do_receive(hal::ReceivedMessage&) override { return {StatusCode::not_ready, ""}; }
    Status do_wait(Microseconds) override { return {}; }
    [[nodiscard]] const char* do_detail() const override { return ""; }
};

}  // namespace tricoil::test
