#include "board/host/serve/udp_service.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {

UdpService::UdpService(std::string name, const TcpAddress& address, Encode encode)
    : name_(std::move(name)), encode_(std::move(encode)) {
    refuse_if(std::stoi(address.port) == 0, "{}: name the port of the receiver", name_);
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

UdpService::~UdpService() {
    if (lost_ > 0) {
        print_notice("tricoil: {}: {} poses were lost, because the network was too slow\n", name_, lost_);
    }
}

void UdpService::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        const std::string datagram = encode_(served);
        if (::send(descriptor_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL) >= 0 || errno == ECONNREFUSED) {
            continue;  // ECONNREFUSED: nobody listens at present
        }
        const bool is_full = errno == EAGAIN || errno == ENOBUFS;
        lost_ += is_full ? 1U : 0U;
        if (!is_full && !is_reported_) {
            print_notice("tricoil: {}: poses cannot be sent ({})\n", name_, std::strerror(errno));
            is_reported_ = true;
        }
    }
}

}  // namespace tricoil::host
