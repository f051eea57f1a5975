// Framed messages on a descriptor: serial line or pseudo terminal.
#pragma once

#include <array>

#include "core/protocol/stream_framing.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/reporting_port.hpp"

namespace tricoil::drivers {

class StreamPort : public ReportingPort {
private:
    /// Returns an open non-blocking descriptor; -1, with the reason in why(), on failure.
    virtual int open_descriptor() = 0;

    Status do_open() final;
    void do_close() final;
    Status do_send(std::span<const std::uint8_t> message) final;
    Status do_receive(hal::ReceivedMessage& message) final;
    Status do_wait(Microseconds timeout) final;

    bool flush();
    Status lost(const char* what);

    FileDescriptor fd_;
    protocol::StreamReader reader_;
    std::array<std::uint8_t, 4096> received_{};
    std::size_t received_size_ = 0;
    std::size_t received_at_ = 0;
    HostTime received_time_{};
    std::array<std::uint8_t, 2 * protocol::kMaxFramedBytes> unsent_{};
    std::size_t unsent_size_ = 0;
};

}  // namespace tricoil::drivers
