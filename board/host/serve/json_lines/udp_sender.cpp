#include "board/host/serve/json_lines/udp_sender.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "board/pose_text/served_pose_line.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::json_lines {

UdpSender::UdpSender(const std::string& option, const TcpAddress& address) {
    const std::string name = fmt::format("{} udp:{}", option, address.text(std::stoi(address.port)));
    addrinfo hints{};
    hints.ai_flags = AI_NUMERICSERV;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (const int failure = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found); failure != 0) {
        throw InputError(fmt::format("{}: no such address ({})", name, ::gai_strerror(failure)));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
    descriptor_.reset(::socket(found->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (::connect(descriptor_.get(), found->ai_addr, found->ai_addrlen) != 0) {
        throw InputError(fmt::format("{}: cannot be reached ({})", name, std::strerror(errno)));
    }
}

void UdpSender::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        const std::string line = served_pose_line(served);
        (void)::send(descriptor_.get(), line.data(), line.size(), MSG_NOSIGNAL);
    }
}

}  // namespace tricoil::host::json_lines
