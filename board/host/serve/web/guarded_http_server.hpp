// httplib server with limits of bytes, time and number of connections, and with reduced requests (request_head).
#pragma once

#include <httplib.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#undef _res  // macro of <resolv.h>, which httplib includes; Eigen has parameters with this name

namespace tricoil::host::web {

/// One request per connection. If all connections are in use, a new one replaces the oldest that is not protected.
class GuardedHttpServer final : public httplib::Server {
public:
    static constexpr std::size_t kMaxConnections = 32;
    static constexpr std::size_t kLongestRequest = 16 * 1024;  // header and body, in bytes
    static constexpr std::chrono::seconds kRequestTimeout{5};  // from the start of service to the end of the request
    static constexpr std::chrono::seconds kAnswerTimeout{10};  // for the client to accept one piece of the answer

    GuardedHttpServer();

    /// Listens on the port; false on failure. The backlog has room for simultaneous clients, because a client that finds it full
    /// tries again only after a second.
    bool bind(const std::string& host, int port);
    /// A handler calls it to protect its connection from replacement. Returns the descriptor.
    int keep_this_connection();
    /// Disconnects all present and future connections.
    void disconnect();

private:
    using Clock = std::chrono::steady_clock;
    struct Connection {
        int socket = -1;
        Clock::time_point since;
        bool kept = false;
        bool leaving = false;
    };
    class Queue;

    bool process_and_close_socket(socket_t socket) override;
    void enter(int socket);
    void forget_socket();
    void make_room();

    std::mutex mutex_;
    std::map<std::thread::id, Connection> connections_;  // by serving thread
    std::size_t waiting_ = 0;                            // accepted connections without a thread
    bool ends_ = false;
};

}  // namespace tricoil::host::web
