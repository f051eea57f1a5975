#include "board/host/serve/connection_table.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
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

/// Time since data was last sent to the client. The kernel sends nothing to a client that does not read.
std::chrono::milliseconds time_without_data(int descriptor) {
    tcp_info info{};
    socklen_t size = sizeof info;
    ::getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size);
    return std::chrono::milliseconds(info.tcpi_last_data_sent);
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
            const auto time = time_without_data(client.descriptor);
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
        notice_.print(fmt::format("client {}, which has read nothing for {} s, is disconnected to make room", silent->name,
                                  std::chrono::floor<std::chrono::seconds>(longest).count()));
        ::shutdown(silent->descriptor, SHUT_RDWR);
    }
    const auto place = clients_.insert(clients_.end(), Client{descriptor, address, peer_text(descriptor)});
    return {&*place, [this, place](const void*) { clients_.erase(place); }};
}

}  // namespace tricoil::host
