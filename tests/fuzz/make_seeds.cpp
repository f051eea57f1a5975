// Writes the seeds of the wire and session fuzzers: one message of each type, plain, as CAN frame and as stream. Usage:
// make_seeds FOLDER
#include <filesystem>
#include <fstream>

#include "core/protocol/stream_framing.hpp"
#include "tests/protocol/random_messages.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): single-file program
using Bytes = std::vector<std::uint8_t>;

void save(const std::filesystem::path& path, const Bytes& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

template <typename Message>
Bytes message(std::mt19937_64& random) {
    return test::bytes_of(test::random_message<Message>(random));
}

void append(Bytes& session, const Bytes& bytes) {
    session.push_back(static_cast<std::uint8_t>(bytes.size()));
    session.push_back(1);
    session.insert(session.end(), bytes.begin(), bytes.end());
}

/// Messages of a device: identity, acknowledgement of start, data.
Bytes conversation(protocol::Role role) {
    Bytes session;
    protocol::IdentifyMessage identity;
    identity.role = static_cast<std::uint8_t>(role);
    append(session, test::bytes_of(identity));
    protocol::AckMessage started;
    started.opcode = static_cast<std::uint8_t>(protocol::Opcode::start);
    started.request = 2;  // after hello
    append(session, test::bytes_of(started));
    for (std::uint32_t n = 0; n < 6; ++n) {
        protocol::ColumnMessage column;
        column.sequence = n;
        column.time_us = 1389 * n;
        protocol::PoseMessage pose;
        pose.sequence = n;
        pose.time_us = 4167 * n;
        append(session, role == protocol::Role::tracker ? test::bytes_of(pose) : test::bytes_of(column));
    }
    return session;
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
                               message<protocol::CheckMessage>(random), message<protocol::RawBlockMessage>(random),
                               message<protocol::CalibrationMessage>(random), message<protocol::ConditionMessage>(random),
                               message<protocol::ParametersMessage>(random)}) {
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
        append(session, bytes);
    }
    save(folder / "session" / "every-type", session);
    for (const auto role : {protocol::Role::front_end, protocol::Role::tracker}) {
        save(folder / "session" / (role == protocol::Role::tracker ? "poses" : "columns"), conversation(role));
    }
    return 0;
}
