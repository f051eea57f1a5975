#include "board/support/tcp_listener.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr int kBacklog = 64;

int port_of(const sockaddr_storage& address) {
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(&address);   // NOLINT: socket interface
    const auto* v6 = reinterpret_cast<const sockaddr_in6*>(&address);  // NOLINT
    return ntohs(address.ss_family == AF_INET6 ? v6->sin6_port : v4->sin_port);
}

std::string name_of(const std::string& option, const TcpAddress& address) {
    return fmt::format("{} {}", option, address.text(std::stoi(address.port)));
}

[[noreturn]] void throw_unusable(const std::string& name, int error) {
    if (error == EADDRINUSE) {
        throw DeviceError(name + ": the port is used by another program; choose another port, or end that program");
    }
    if (error == EACCES) {
        throw InputError(name + ": ports below 1024 need root; choose another port");
    }
    throw InputError(fmt::format("{}: cannot listen ({})", name, std::strerror(error)));
}

}  // namespace

std::string TcpAddress::text(int port_number) const {
    const bool is_v6 = host.find(':') != std::string::npos;
    return fmt::format("{}:{}", is_v6 ? '[' + host + ']' : host, port_number);
}

TcpAddress parse_tcp_address(const std::string& option, const std::string& text) {
    TcpAddress address;
    const auto colon = text.rfind(':');
    address.port = colon == std::string::npos ? text : text.substr(colon + 1);
    if (colon != std::string::npos && colon > 0) {
        address.host = text.substr(0, colon);
        if (address.host.front() == '[' && address.host.back() == ']') {
            address.host = address.host.substr(1, address.host.size() - 2);
        }
    }
    refuse_if(!number_from<std::uint16_t>(address.port), "{} {}: needs a port number up to 65535, or ADDRESS:PORT", option, text);
    return address;
}

void set_connection_options(int listening) {
    constexpr int kFirstProbe_s = 10;
    constexpr int kProbePeriod_s = 5;
    constexpr int kSilence_ms = static_cast<int>(std::chrono::milliseconds(kSilenceLimit).count());
    const auto set = [listening](int level, int option, int value) {
        ::setsockopt(listening, level, option, &value, sizeof value);
    };
    set(SOL_SOCKET, SO_KEEPALIVE, 1);
    set(IPPROTO_TCP, TCP_KEEPIDLE, kFirstProbe_s);
    set(IPPROTO_TCP, TCP_KEEPINTVL, kProbePeriod_s);
    set(IPPROTO_TCP, TCP_USER_TIMEOUT, kSilence_ms);
    set(IPPROTO_TCP, TCP_NODELAY, 1);
}

sockaddr_storage peer_of(int descriptor) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&address), &size);  // NOLINT: socket interface
    return address;
}

std::string peer_text(int descriptor) { return address_text(peer_of(descriptor)); }

std::string address_text(const sockaddr_storage& address) {
    std::array<char, NI_MAXHOST> host{};
    ::getnameinfo(reinterpret_cast<const sockaddr*>(&address), sizeof address, host.data(), host.size(),  // NOLINT
                  nullptr, 0, NI_NUMERICHOST);
    return TcpAddress{host.data(), {}}.text(port_of(address));
}

drivers::FileDescriptor bind_socket(const std::string& option, const TcpAddress& address, int type) {
    const std::string name = name_of(option, address);
    addrinfo hints{};
    hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
    hints.ai_socktype = type;
    addrinfo* found = nullptr;
    const int failure = ::getaddrinfo(address.host == "*" ? nullptr : address.host.c_str(), address.port.c_str(), &hints, &found);
    if (failure != 0) {
        throw InputError(fmt::format("{}: no such address ({}); give an address of this machine", name, ::gai_strerror(failure)));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
    drivers::FileDescriptor descriptor(::socket(found->ai_family, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (descriptor.is_open() && type == SOCK_STREAM) {
        const int yes = 1;
        ::setsockopt(descriptor.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    }
    if (!descriptor.is_open() || ::bind(descriptor.get(), found->ai_addr, found->ai_addrlen) != 0) {
        throw_unusable(name, errno);
    }
    return descriptor;
}

void warn_of_exposure(const std::string& option, const TcpAddress& address, const std::string& can) {
    if (!address.is_loopback()) {
        print_notice("tricoil: {}: everyone who reaches this address can {}; there is no encryption\n", name_of(option, address),
                     can);
    }
}

TcpListener::TcpListener(const std::string& option, const TcpAddress& address)
    : descriptor_(bind_socket(option, address, SOCK_STREAM)) {
    set_connection_options(descriptor_.get());
    if (::listen(descriptor_.get(), kBacklog) != 0) {
        throw_unusable(name_of(option, address), errno);
    }
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    ::getsockname(descriptor_.get(), reinterpret_cast<sockaddr*>(&own), &size);  // NOLINT: socket interface
    port_ = port_of(own);
}

int TcpListener::accept() const { return ::accept4(descriptor_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC); }

}  // namespace tricoil::host
