// Sends each pose as one UDP datagram.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "board/host/serve/service.hpp"
#include "board/support/tcp_listener.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// A datagram that cannot be sent at once is lost and counted; the number is printed at the end. A failure other than a missing
/// receiver or a full queue is printed once.
class UdpService final : public Service {
public:
    using Encode = std::function<std::string(const ServedPose&)>;

    /// name: option and address, for messages. Throws InputError for an unknown host or port 0; DeviceError if the name server
    /// does not answer or the host cannot be reached.
    UdpService(std::string name, const TcpAddress& address, Encode encode);
    ~UdpService() override;

    void take(std::span<const ServedPose> poses) override;

private:
    std::string name_;
    Encode encode_;
    drivers::FileDescriptor descriptor_;
    std::uint64_t lost_ = 0;  // datagrams
    bool is_reported_ = false;
};

}  // namespace tricoil::host
