// Random bytes of a WebSocket client: its handshake, and its frames after a handshake.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <span>
#include <string_view>

#include "board/host/serve/websocket/session.hpp"
#include "tests/fuzz/served_poses.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file

constexpr std::string_view kHandshake =
    "GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

void drain(int client) {
    std::array<char, 4096> answers{};
    while (::recv(client, answers.data(), answers.size(), MSG_DONTWAIT) > 0) {
    }
}

/// No page is permitted, so an accepted request has no origin.
void check_handshake(std::string_view received) {
    const auto head = host::web::read_head(received);
    if (!head) {
        return;
    }
    const auto answer = host::websocket::answer_handshake(*head, {});
    const bool is_whole = answer.text.starts_with("HTTP/1.1 ") && answer.text.find("\r\n\r\n") != std::string::npos;
    if (!is_whole || answer.accepted != answer.text.starts_with("HTTP/1.1 101 ")) {
        std::abort();
    }
}

}  // namespace

/// The first byte selects the handshake or the frames; each later piece begins with its length.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    std::array<int, 2> ends{};
    if (size == 0 || ::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
        return 0;
    }
    {
        const std::vector<std::string> origins;
        host::Stream stream(ends[0]);
        host::websocket::Session session(stream, origins);
        std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);  // NOLINT: bytes as text
        if (data[0] % 2 == 0) {
            check_handshake(rest);
        } else {
            session.receive(kHandshake);
        }
        for (std::uint32_t n = 0; !rest.empty() && !stream.gone(); ++n) {
            const std::size_t length = std::min<std::size_t>(static_cast<std::uint8_t>(rest[0]), rest.size() - 1);
            session.receive(rest.substr(1, length));
            rest.remove_prefix(1 + length);
            session.take(fuzz::served_poses(n));
            stream.flush();
            drain(ends[1]);
        }
    }
    ::close(ends[1]);
    return 0;
}
