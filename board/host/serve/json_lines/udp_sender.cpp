#include "board/host/serve/json_lines/udp_sender.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "board/pose_text/served_pose_line.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host::json_lines {

UdpSender::UdpSender(const std::string& option, const TcpAddress& address)
    : name_(fmt::format("{} udp:{}", option, address.text(std::stoi(address.port)))) {
    addrinfo hints{};
    hints.ai_flags = AI_NUMERICSERV;
    hints.ai_socktype = SOCK_DGRAM;
    hints.ai_family = address.host == "localhost" ? AF_INET : AF_UNSPEC;  // receivers usually listen on IPv4
    addrinfo* found = nullptr;
    const int failure = ::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
    if (failure == EAI_AGAIN) {
        throw DeviceError(fmt::format("{}: the name server does not answer; give a numeric address", name_));
    }
    if (failure != 0) {
        throw InputError(fmt::format("{}: no such address ({}); check the host name", name_, ::gai_strerror(failure)));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
    for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
        descriptor_.reset(::socket(at->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
        if (descriptor_.get() >= 0 && ::connect(descriptor_.get(), at->ai_addr, at->ai_addrlen) == 0) {
            return;
        }
    }
    throw DeviceError(fmt::format("{}: cannot be reached ({}); check the address and the network", name_, std::strerror(errno)));
}

void UdpSender::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        const std::string line = served_pose_line(served);
        const bool is_sent = ::send(descriptor_.get(), line.data(), line.size(), MSG_NOSIGNAL) >= 0;
        // ECONNREFUSED: nobody listens at present. EAGAIN, ENOBUFS: the queue is full.
        const bool is_usual = is_sent || errno == ECONNREFUSED || errno == EAGAIN || errno == ENOBUFS;
        if (!is_usual && !is_told_) {
            print_notice("tricoil: {}: poses cannot be sent ({})\n", name_, std::strerror(errno));
            is_told_ = true;
        }
    }
}

}  // namespace tricoil::host::json_lines
