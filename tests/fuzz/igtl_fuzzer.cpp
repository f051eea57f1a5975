// Random requests of an OpenIGTLink client. Input format: per message a length byte, a kind byte and the body. With an even kind
// byte the body gets a header with a valid CRC, so that it is read; with an odd one it is sent without a header.
#include <igtl_util.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

#include "board/host/serve/openigtlink/igtl_session.hpp"
#include "tests/fuzz/served_poses.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file
using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kHeaderBytes = 58;

/// A message with a valid header before the body.
std::vector<char> framed(std::uint8_t kind, Bytes body) {
    constexpr std::array<const char*, 5> kTypes{"STT_TDATA", "STP_TDATA", "GET_STATUS", "GET_TRANS", "TRANSFORM"};
    std::vector<char> message(kHeaderBytes + body.size(), '\0');
    message[1] = static_cast<char>(1 + kind / kTypes.size() % 2);  // version
    std::strncpy(&message[2], kTypes[kind % kTypes.size()], 12);
    std::memcpy(message.data() + kHeaderBytes, body.data(), body.size());
    const std::uint64_t crc = crc64(reinterpret_cast<unsigned char*>(message.data()) + kHeaderBytes, body.size(), 0);  // NOLINT
    for (unsigned n = 0; n < 8; ++n) {
        message[42 + n] = static_cast<char>(std::uint64_t{body.size()} >> 8 * (7 - n));
        message[50 + n] = static_cast<char>(crc >> 8 * (7 - n));
    }
    return message;
}

void drain(int client) {
    std::array<char, 4096> answers{};
    while (::recv(client, answers.data(), answers.size(), MSG_DONTWAIT) > 0) {
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
        std::abort();
    }
    {
        host::Stream stream(ends[0]);
        host::igtl_output::Session session(stream);
        Bytes rest(data, size);
        for (std::uint32_t n = 0; rest.size() > 2 && !stream.gone(); ++n) {
            const std::size_t length = std::min<std::size_t>(rest[0], rest.size() - 2);
            const Bytes body = rest.subspan(2, length);
            if (rest[1] % 2 == 0) {
                session.receive(framed(rest[1] / 2, body));
            } else {
                session.receive({reinterpret_cast<const char*>(body.data()), body.size()});  // NOLINT: bytes as they come
            }
            rest = rest.subspan(2 + length);
            session.take(fuzz::served_poses(n));
            stream.flush();
            drain(ends[1]);
        }
    }
    ::close(ends[1]);
    return 0;
}
