// Checks the host name of a request.
#pragma once

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "board/support/tcp_listener.hpp"

namespace tricoil::host::web {

/// True for a numeric address as in a URL: 192.0.2.1 or [2001:db8::1].
inline bool is_ip_address(const std::string& name) {
    std::array<unsigned char, sizeof(in6_addr)> address{};
    const bool bracketed = name.size() > 2 && name.front() == '[' && name.back() == ']';
    return ::inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
           (bracketed && ::inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), address.data()) == 1);
}

/// host: Host field of a request. Accepted are loopback names, the listening address or name, the allowed names and, if the
/// server listens on all addresses, any numeric address. Other names are refused, because a hostile page can use a name that
/// resolves to this machine (DNS rebinding).
inline bool is_own_name(const std::string& host, const TcpAddress& address, int port,
                        const std::vector<std::string>& allowed = {}) {
    constexpr int kUsualPort = 80;  // HTTP port, which browsers omit
    const std::string behind = fmt::format(":{}", port);
    std::string name = host;
    if (name.ends_with(behind)) {
        name.resize(name.size() - behind.size());
    } else if (port != kUsualPort) {
        return false;
    }
    return name == "localhost" || name == "127.0.0.1" || name == "[::1]" || name + behind == address.text(port) ||
           std::find(allowed.begin(), allowed.end(), name) != allowed.end() || (address.is_any() && is_ip_address(name));
}

}  // namespace tricoil::host::web
