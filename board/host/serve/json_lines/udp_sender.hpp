// Sends each pose as one UDP datagram.
#pragma once

#include <string>

#include "board/host/serve/service.hpp"
#include "board/host/serve/tcp_listener.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host::json_lines {

/// One JSON line per datagram. A datagram that cannot be sent at once is lost. A failure other than a missing receiver or a
/// full queue is printed once.
class UdpSender final : public Service {
public:
    /// Throws InputError for an unknown host; DeviceError if the name server does not answer or the host cannot be reached. Both
    /// name `option`.
    UdpSender(const std::string& option, const TcpAddress& address);

    bool watch(std::vector<pollfd>& /*descriptors*/) override { return false; }
    void handle() override {}
    void take(std::span<const ServedPose> poses) override;

private:
    std::string name_;
    drivers::FileDescriptor descriptor_;
    bool is_told_ = false;
};

}  // namespace tricoil::host::json_lines
