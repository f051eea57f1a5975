// httplib's server with limits for each connection: bytes, time, places, and requests in a reduced form (request_head).
#pragma once

#include <httplib.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#undef _res  // a macro of <resolv.h>, which httplib includes; Eigen has parameters of that name

namespace tricoil::host::web {

/// One request a connection. A newcomer that finds all places taken gets that of the oldest connection that is not kept.
class GuardedHttpServer final : public httplib::Server {
public:
    static constexpr std::size_t kMostConnections = 32;
    static constexpr std::size_t kLongestRequest = 16 * 1024;   // header and body, in bytes
    static constexpr std::chrono::seconds kRequestPatience{5};  // from connection to the end of the request
    static constexpr std::chrono::seconds kAnswerPatience{10};  // for the client to take one piece of the answer

    GuardedHttpServer();

    /// False if it is not to be had. With room for those who come at once: who finds none tries again after a second.
    bool bind(const std::string& host, int port);
    /// For a handler: its connection lasts for as long as the client likes.
    void keep_this_connection();
    /// On all connections, those to come too.
    void hang_up();

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
    void leave();
    void make_room();

    std::mutex mutex_;
    std::map<std::thread::id, Connection> connections_;  // by the thread that serves it
    std::size_t waiting_ = 0;                            // accepted, and no thread for them yet
    bool ends_ = false;
};

}  // namespace tricoil::host::web
