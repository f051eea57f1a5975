// Serves the clients of a TCP port, each with its own session.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "board/host/serve/connection_table.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/stream.hpp"
#include "board/support/tcp_listener.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {

constexpr std::size_t kLongestHttpMethod = 8;  // with the space behind it

/// True if the first bytes of a client begin an HTTP request: a method and a space, at most kLongestHttpMethod bytes.
inline bool begins_http_request(std::string_view opening) {
    constexpr std::array<std::string_view, 9> kOpenings{"GET ",   "HEAD ",    "POST ",    "PUT ",  "DELETE ",
                                                        "PATCH ", "OPTIONS ", "CONNECT ", "TRACE "};
    return std::any_of(kOpenings.begin(), kOpenings.end(), [&](std::string_view method) { return opening.starts_with(method); });
}

constexpr std::string_view kHttpRefusal =
    "HTTP/1.1 400 Refused\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\nThis port does not serve HTTP.\n";

/// Session: has receive(std::span<const char>) and take(std::span<const ServedPose>). The factory gives it the Stream through
/// which it sends and disconnects. A client that begins with an HTTP request is refused, because a page in a browser can send one
/// to any port and its text must not act as commands; not if Session::kSpeaksHttp exists. If Session::is_busy() exists and is
/// true, the wait for the next round is short.
template <typename Session>
class TcpService final : public Service {
public:
    using Factory = std::function<std::unique_ptr<Session>(Stream&)>;

    /// replaceable: of ConnectionTable.
    TcpService(std::string option, const TcpAddress& address, Factory factory, const StreamLimits& limits = {},
               std::chrono::milliseconds replaceable = ConnectionTable::kReplaceable)
        : name_(std::move(option)),
          listener_(name_, address),
          factory_(std::move(factory)),
          limits_(limits),
          table_(name_, replaceable),
          notice_(name_) {}

    /// Prints how many records were dropped.
    ~TcpService() override {
        for (const auto& client : clients_) {
            dropped_ += client->stream.dropped();
        }
        if (dropped_ > 0) {
            print_notice("tricoil: {}: {} records were dropped, because clients read too slowly\n", name_, dropped_);
        }
    }

    [[nodiscard]] int port() const { return listener_.port(); }

    bool watch(std::vector<pollfd>& descriptors) override {
        descriptors.push_back({listener_.descriptor(), POLLIN, 0});
        bool pauses = false;
        for (const auto& client : clients_) {
            descriptors.push_back({client->stream.descriptor(), client->stream.events(), 0});
            pauses = pauses || client->stream.pauses();
            if constexpr (requires { client->session->is_busy(); }) {
                pauses = pauses || client->session->is_busy();
            }
        }
        return pauses;
    }

    void handle() override {
        accept_client();
        for (const auto& client : clients_) {
            client->stream.flush();
            if (const auto bytes = client->stream.receive(); !bytes.empty() && !is_refused(*client, bytes)) {
                client->session->receive(bytes);
            }
        }
        std::erase_if(clients_, [this](const auto& client) {
            if (!client->stream.reason().empty()) {
                notice_.print("client refused: " + client->stream.reason());
            }
            dropped_ += client->stream.gone() ? client->stream.dropped() : 0;
            return client->stream.gone();
        });
    }

    void take(std::span<const ServedPose> poses) override {
        for (const auto& client : clients_) {
            client->session->take(poses);
        }
    }

private:
    struct Client {
        Client(int descriptor, const StreamLimits& limits) : stream(descriptor, limits) {}
        Stream stream;
        std::unique_ptr<Session> session;
        std::string opening;  // first bytes
    };

    void accept_client() {
        for (std::size_t n = 0; n < ConnectionTable::kMaxClients; ++n) {  // further clients in the next round
            const int descriptor = listener_.accept();
            if (descriptor < 0) {
                return;
            }
            auto client = std::make_unique<Client>(descriptor, limits_);
            if (auto place = table_.enter(descriptor)) {
                client->stream.hold(std::move(place));
                client->session = factory_(client->stream);
                clients_.push_back(std::move(client));
            }
        }
    }

    bool is_refused(Client& client, std::span<const char> bytes) {
        constexpr bool kSpeaksHttp = requires { Session::kSpeaksHttp; };
        if (kSpeaksHttp || client.opening.size() >= kLongestHttpMethod) {
            return false;
        }
        client.opening.append(bytes.data(), bytes.size());
        if (!begins_http_request(client.opening)) {
            return false;
        }
        notice_.print(fmt::format("client {} refused: it sends an HTTP request", peer_text(client.stream.descriptor())));
        client.stream.send(kHttpRefusal);
        client.stream.disconnect();
        return true;
    }

    std::string name_;
    TcpListener listener_;
    Factory factory_;
    StreamLimits limits_;
    ConnectionTable table_;
    LimitedNotice notice_;
    std::vector<std::unique_ptr<Client>> clients_;
    std::uint64_t dropped_ = 0;  // records of clients that have left
};

}  // namespace tricoil::host
