// Writes the seeds of the wire and session fuzzers: one message of each type in every wrapping. make_seeds FOLDER
#include <filesystem>
#include <fstream>

#include "core/protocol/stream_framing.hpp"
#include "tests/protocol/random_messages.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file
using Bytes = std::vector<std::uint8_t>;

void save(const std::filesystem::path& path, const Bytes& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

template <typename Message>
Bytes message(std::mt19937_64& random) {
    return test::bytes_of(test::random_message<Message>(random));
}

}  // namespace

int main(int, char** arguments) {
    std::mt19937_64 random(1);
    const std::filesystem::path folder(arguments[1]);
    std::filesystem::create_directories(folder / "wire");
    std::filesystem::create_directories(folder / "session");
    Bytes session;
    for (const Bytes& bytes : {message<protocol::IdentifyMessage>(random), message<protocol::AckMessage>(random),
                               message<protocol::CommandMessage>(random), message<protocol::StatusMessage>(random),
                               message<protocol::ColumnMessage>(random), message<protocol::PoseMessage>(random),
                               message<protocol::CouplingsMessage>(random), message<protocol::CovarianceMessage>(random),
                               message<protocol::CheckMessage>(random), message<protocol::RawBlockMessage>(random),
                               message<protocol::CalibrationMessage>(random)}) {
        const std::string name = "type" + std::to_string(bytes[1]);
        for (const int wrapping : {0, 1}) {
            Bytes seed{static_cast<std::uint8_t>(wrapping)};
            seed.insert(seed.end(), bytes.begin(), bytes.end());
            save(folder / "wire" / (name + (wrapping == 0 ? "-message" : "-frame")), seed);
        }
        Bytes framed(protocol::framed_bytes(bytes.size()) + 1);
        framed[0] = 3;
        framed.resize(1 + protocol::frame(bytes, std::span(framed).subspan(1)));
        save(folder / "wire" / (name + "-stream"), framed);
        session.push_back(static_cast<std::uint8_t>(bytes.size()));
        session.push_back(5);
        session.insert(session.end(), bytes.begin(), bytes.end());
    }
    save(folder / "session" / "every-type", session);
    return 0;
}
