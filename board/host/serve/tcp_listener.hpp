// A TCP port that clients come to.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Where to listen. "18944", ":18944", "127.0.0.1:18944", "[::]:18944", "*:18944".
struct TcpAddress {
    std::string host = "127.0.0.1";  // this machine alone, unless told otherwise
    std::string port;

    /// As in a URL: "127.0.0.1:18944", "[::1]:18944".
    [[nodiscard]] std::string text(int port_number) const;
    /// Whether it stands for all addresses of this machine.
    [[nodiscard]] bool is_any() const { return host == "*" || host == "0.0.0.0" || host == "::"; }
    /// Whether only this machine reaches it. A name is taken for one of the network's, but for localhost.
    [[nodiscard]] bool is_loopback() const { return host == "localhost" || host == "::1" || host.starts_with("127."); }
};

/// Throws InputError, beginning with `option`, for what is no address.
TcpAddress parse_tcp_address(const std::string& option, const std::string& text);

class TcpListener {
public:
    /// Throws InputError for an address that this machine does not have, DeviceError for a port in use; both name `option`.
    TcpListener(const std::string& option, const TcpAddress& address);

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }
    /// The port, also where 0 was asked for.
    [[nodiscard]] int port() const { return port_; }
    /// The next client's line; -1: none waits.
    [[nodiscard]] int accept() const;

private:
    drivers::FileDescriptor descriptor_;
    int port_ = 0;
};

}  // namespace tricoil::host
