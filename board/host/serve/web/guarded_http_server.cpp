#include "board/host/serve/web/guarded_http_server.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "board/host/serve/web/request_head.hpp"

namespace tricoil::host::web {
namespace {

using Clock = std::chrono::steady_clock;

/// httplib stream of one connection. It applies the limits of bytes and time.
class GuardedStream final : public httplib::Stream {
public:
    explicit GuardedStream(int socket) : socket_(socket) {}

    [[nodiscard]] bool is_readable() const override { return at_ < received_.size() || ready(POLLIN, request_deadline_); }
    [[nodiscard]] bool is_writable() const override { return ready(POLLOUT, Clock::now() + GuardedHttpServer::kAnswerTimeout); }

    /// Reads the head of the request; false if it is incomplete. The library then reads its reduced form.
    bool receive_head(RequestHead& head) {
        constexpr std::string_view kEnd = "\r\n\r\n";
        std::size_t end = std::string::npos;
        while (end == std::string::npos) {
            const std::size_t searched = received_.size() - std::min(received_.size(), kEnd.size() - 1);
            if (!fill()) {
                return false;
            }
            end = received_.find(kEnd, searched);
        }
        end += kEnd.size();
        head = reduced_head(std::string_view(received_).substr(0, end));
        received_.replace(0, end, head.text);
        return true;
    }

    ssize_t read(char* data, std::size_t size) override {
        if (at_ == received_.size() && !fill()) {
            return -1;
        }
        const std::size_t n = received_.copy(data, size, at_);
        at_ += n;
        return static_cast<ssize_t>(n);
    }

    ssize_t write(const char* data, std::size_t size) override {
        const auto deadline = Clock::now() + GuardedHttpServer::kAnswerTimeout;
        for (std::size_t done = 0; done < size;) {
            if (!ready(POLLOUT, deadline)) {
                return -1;
            }
            const ssize_t n = ::send(socket_, data + done, size - done, MSG_NOSIGNAL | MSG_DONTWAIT);
            if (n < 0 && errno != EAGAIN && errno != EINTR) {
                return -1;
            }
            done += static_cast<std::size_t>(std::max<ssize_t>(n, 0));
        }
        return static_cast<ssize_t>(size);
    }

    void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}  // not used
    void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
    [[nodiscard]] socket_t socket() const override { return socket_; }

private:
    [[nodiscard]] bool ready(short events, Clock::time_point deadline) const {
        for (;;) {
            const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
            pollfd descriptor{socket_, events, 0};
            const int n = ::poll(&descriptor, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
            if (n >= 0 || errno != EINTR) {
                return n > 0 && (descriptor.revents & events) != 0;
            }
        }
    }

    bool fill() {
        std::array<char, 2048> piece{};
        const std::size_t allowed = std::min(piece.size(), GuardedHttpServer::kLongestRequest - bytes_read_);
        if (allowed == 0 || !ready(POLLIN, request_deadline_)) {
            return false;
        }
        const ssize_t n = ::recv(socket_, piece.data(), allowed, MSG_DONTWAIT);
        if (n <= 0) {
            return false;
        }
        received_.append(piece.data(), static_cast<std::size_t>(n));
        bytes_read_ += static_cast<std::size_t>(n);
        return true;
    }

    int socket_;
    Clock::time_point request_deadline_ = Clock::now() + GuardedHttpServer::kRequestTimeout;
    std::string received_;
    std::size_t at_ = 0;  // number of bytes of received_ that the library has read
    std::size_t bytes_read_ = 0;
};

}  // namespace

/// Thread pool of httplib that reports every new connection.
class GuardedHttpServer::Queue final : public httplib::TaskQueue {
public:
    explicit Queue(GuardedHttpServer& server) : server_(server), pool_(kMaxConnections) {}

    void enqueue(std::function<void()> serve) override {
        {
            const std::lock_guard lock(server_.mutex_);
            ++server_.waiting_;
            server_.make_room();
        }
        pool_.enqueue(std::move(serve));
    }
    void shutdown() override {
        server_.disconnect();
        pool_.shutdown();
    }

private:
    GuardedHttpServer& server_;
    httplib::ThreadPool pool_;
};

GuardedHttpServer::GuardedHttpServer() {
    new_task_queue = [this] { return new Queue(*this); };  // NOLINT: the library deletes it
}

bool GuardedHttpServer::bind(const std::string& host, int port) {
    constexpr int kBacklog = 128;
    return bind_to_port(host, port) && ::listen(svr_sock_, kBacklog) == 0;
}

int GuardedHttpServer::keep_this_connection() {
    const std::lock_guard lock(mutex_);
    Connection& connection = connections_[std::this_thread::get_id()];
    connection.kept = true;
    return connection.socket;
}

void GuardedHttpServer::disconnect() {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    for (auto& [thread, connection] : connections_) {
        ::shutdown(connection.socket, SHUT_RDWR);
    }
}

bool GuardedHttpServer::process_and_close_socket(socket_t socket) {
    enter(socket);
    GuardedStream stream(socket);
    RequestHead head;
    bool served = stream.receive_head(head);
    if (served && head.refusal != 0) {
        const std::string answer = refusal_answer(head);
        served = stream.write(answer.data(), answer.size()) > 0;
    } else if (served) {
        bool closed = false;
        served = process_request(stream, true, closed, nullptr);
    }
    forget_socket();  // before close(), because a new connection may then get the same descriptor
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return served;
}

void GuardedHttpServer::enter(int socket) {
    const std::lock_guard lock(mutex_);
    --waiting_;
    connections_[std::this_thread::get_id()] = {socket, Clock::now()};
    if (ends_) {
        ::shutdown(socket, SHUT_RDWR);
    }
    make_room();
}

void GuardedHttpServer::forget_socket() {
    const std::lock_guard lock(mutex_);
    connections_.erase(std::this_thread::get_id());
}

void GuardedHttpServer::make_room() {
    const auto leaving = std::count_if(connections_.begin(), connections_.end(), [](const auto& c) { return c.second.leaving; });
    std::size_t places = kMaxConnections - connections_.size() + static_cast<std::size_t>(leaving);
    for (; places < waiting_; ++places) {
        Connection* oldest = nullptr;
        for (auto& [thread, connection] : connections_) {
            const bool may_go = !connection.kept && !connection.leaving;
            if (may_go && (oldest == nullptr || connection.since < oldest->since)) {
                oldest = &connection;
            }
        }
        if (oldest == nullptr) {
            return;
        }
        oldest->leaving = true;
        ::shutdown(oldest->socket, SHUT_RDWR);
    }
}

}  // namespace tricoil::host::web
