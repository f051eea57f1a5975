#include "board/host/serve/connection_table.hpp"

#include <linux/tcp.h>  // tcp_info with the window
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>

#include "board/support/tcp_listener.hpp"

namespace tricoil::host {
namespace {

/// Address bytes that identify a client's machine: a machine on IPv6 may use every address of its network (64 bits).
std::string address_of(int descriptor) {
    constexpr std::size_t kNetwork = 8;
    const sockaddr_storage peer = peer_of(descriptor);
    if (peer.ss_family != AF_INET6) {
        const auto& v4 = reinterpret_cast<const sockaddr_in&>(peer).sin_addr;  // NOLINT: socket interface
        return {reinterpret_cast<const char*>(&v4), sizeof v4};                // NOLINT
    }
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr;  // NOLINT
    const std::string bytes(reinterpret_cast<const char*>(&v6), sizeof v6);  // NOLINT
    if (IN6_IS_ADDR_V4MAPPED(&v6)) {
        return bytes.substr(bytes.size() - sizeof(in_addr));
    }
    return IN6_IS_ADDR_LINKLOCAL(&v6) ? bytes : bytes.substr(0, kNetwork);
}

tcp_info state_of(int descriptor) {
    tcp_info info{};
    socklen_t size = sizeof info;
    ::getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size);
    return info;
}

}  // namespace

ConnectionTable::Place ConnectionTable::enter(int descriptor) {
    const std::string address = address_of(descriptor);
    const auto count = [&](bool of_this_address) {
        return static_cast<std::size_t>(std::count_if(clients_.begin(), clients_.end(), [&](const Client& client) {
            return !client.leaving && (!of_this_address || client.address == address);
        }));
    };
    const bool address_is_full = count(true) >= kMaxOfOneAddress;
    if (address_is_full || count(false) >= kMaxClients) {
        Client* silent = nullptr;
        auto longest = replaceable_;
        for (Client& client : clients_) {
            // Unread data closes the window, but the kernel sends until the client's buffers are full.
            const tcp_info info = state_of(client.descriptor);
            const auto closed = info.tcpi_snd_wnd < client.window / 2 ? kReplaceable : std::chrono::milliseconds{0};
            const auto time = std::chrono::milliseconds(info.tcpi_last_data_sent) + closed;
            if (!client.leaving && (!address_is_full || client.address == address) && time >= longest) {
                longest = time;
                silent = &client;
            }
        }
        if (silent == nullptr) {
            notice_.print(fmt::format("client {} refused: limit of {} clients{} reached", peer_text(descriptor),
                                      address_is_full ? kMaxOfOneAddress : kMaxClients,
                                      address_is_full ? " of one address" : ""));
            return nullptr;
        }
        silent->leaving = true;
        notice_.print(fmt::format("client {}, which does not read, is disconnected to make room", silent->name));
        ::shutdown(silent->descriptor, SHUT_RDWR);
    }
    const auto place =
        clients_.insert(clients_.end(), Client{descriptor, address, peer_text(descriptor), state_of(descriptor).tcpi_snd_wnd});
    return {&*place, [this, place](const void*) { clients_.erase(place); }};
}

}  // namespace tricoil::host
