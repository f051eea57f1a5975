// Ports of this machine: addresses, listening sockets.
#pragma once

#include <sys/socket.h>

#include <chrono>
#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Listening address: "18944", ":18944", "127.0.0.1:18944", "[::]:18944", "*:18944".
struct TcpAddress {
    std::string host = "127.0.0.1";  // default: loopback
    std::string port;

    /// As in a URL: "127.0.0.1:18944", "[::1]:18944".
    [[nodiscard]] std::string text(int port_number) const;
    /// True if `host` means all addresses of this machine.
    [[nodiscard]] bool is_any() const { return host == "*" || host == "0.0.0.0" || host == "::"; }
    /// As in a URL for a client on this machine.
    [[nodiscard]] TcpAddress shown() const { return is_any() ? TcpAddress{"localhost", ""} : *this; }
    /// True if only this machine can reach it. A host name other than localhost counts as a network address.
    [[nodiscard]] bool is_loopback() const {
        const bool is_number = host.find_first_not_of("0123456789.") == std::string::npos;
        return host == "localhost" || host == "::1" || (is_number && host.starts_with("127."));
    }
};

/// Throws InputError, beginning with `option`, for an invalid address.
TcpAddress parse_tcp_address(const std::string& option, const std::string& text);

/// Opens a socket that does not block, and binds it. type: SOCK_STREAM or SOCK_DGRAM. Throws InputError for an address that this
/// machine does not have or a port that needs root, DeviceError for a port in use; both name `option`.
drivers::FileDescriptor bind_socket(const std::string& option, const TcpAddress& address, int type);

/// Prints a notice if `address` is not loopback. can: what everyone who reaches it can do.
void warn_of_exposure(const std::string& option, const TcpAddress& address, const std::string& can);

/// A connection ends if the other machine does not answer, or its program does not read waiting data, for this time.
inline constexpr std::chrono::seconds kSilenceLimit{30};

/// Sets the options of a listening socket that its connections inherit: no delay of small records, and kSilenceLimit.
void set_connection_options(int listening);

/// Address of the client at the other end.
sockaddr_storage peer_of(int descriptor);
/// As in "127.0.0.1:40312".
std::string address_text(const sockaddr_storage& address);
std::string peer_text(int descriptor);

class TcpListener {
public:
    /// Throws the errors of bind_socket().
    TcpListener(const std::string& option, const TcpAddress& address);

    [[nodiscard]] int descriptor() const { return descriptor_.get(); }
    /// Actual port, also if 0 was requested.
    [[nodiscard]] int port() const { return port_; }
    /// Accepts the next client. Returns its descriptor, or -1 if none waits or on failure.
    [[nodiscard]] int accept() const;

private:
    drivers::FileDescriptor descriptor_;
    int port_ = 0;
};

}  // namespace tricoil::host
