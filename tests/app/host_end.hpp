// Host at the other end of a link: sends commands, stores the messages that it receives.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "core/protocol/codec.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/negotiation.hpp"
#include "tests/support/memory_port.hpp"

namespace tricoil::test {

class HostEnd {
public:
    explicit HostEnd(sim::MemoryPort& device) : port_(256) {
        port_.connect(device);
        (void)port_.open();
    }

    void send(std::span<const std::uint8_t> bytes) { (void)port_.send(bytes); }
    template <typename Message>
    void say(const Message& message) {
        std::array<std::uint8_t, protocol::kMaxMessageBytes> bytes{};
        send(std::span<const std::uint8_t>(bytes).first(protocol::encode(message, bytes)));
    }
    void command(protocol::Opcode opcode, std::uint32_t argument = 0, Excitation state = Excitation::off) {
        protocol::CommandMessage m;
        m.sequence = sequence_++;
        m.opcode = static_cast<std::uint8_t>(opcode);
        m.argument = argument;
        m.state = static_cast<std::uint8_t>(state);
        m.request = ++request_;
        say(m);
    }
    /// The next message gets the sequence number of the newest one.
    void say_again() { --sequence_; }
    void hello() { command(protocol::Opcode::hello, protocol::hello_argument({})); }
    void start() { command(protocol::Opcode::start); }
    void keep_alive() { command(protocol::Opcode::keep_alive); }
    void write(std::span<const std::uint8_t> blob) {
        protocol::CalibrationMessage m;
        m.sequence = sequence_++;
        m.request = ++request_;
        m.tail = blob;
        say(m);
        written_ = {m, {blob.begin(), blob.end()}};
    }
    /// Sends the newest calibration or part of an image again.
    void repeat() {
        written_.first.sequence = sequence_++;
        written_.first.tail = written_.second;
        say(written_.first);
    }

    void write_image(std::uint32_t offset, std::span<const std::uint8_t> part) {
        std::vector<std::uint8_t> blob(protocol::kImagePartHeader + protocol::kImagePartBytes, 0xFF);
        protocol::put_bytes(blob.data(), protocol::kImagePart, 4);
        protocol::put_bytes(blob.data() + 4, offset, 4);
        std::copy(part.begin(), part.end(), blob.begin() + protocol::kImagePartHeader);
        write(blob);
    }

    /// Receives all waiting messages.
    void listen() {
        hal::ReceivedMessage message;
        while (port_.receive(message).ok()) {
            ++heard;
            bool known = false;
            known = keep(message.bytes, acks) || known;
            known = keep(message.bytes, poses) || known;
            known = keep(message.bytes, columns) || known;
            known = keep(message.bytes, checks) || known;
            known = keep(message.bytes, identities) || known;
            known = keep(message.bytes, statuses) || known;
            known = keep(message.bytes, conditions) || known;
            known = keep(message.bytes, parameters) || known;
            protocol::CalibrationMessage calibration;
            if (protocol::decode(message.bytes, calibration) == protocol::WireError::none) {
                blobs.emplace_back(calibration.tail.begin(), calibration.tail.end());
                known = true;
            }
            protocol::RawBlockMessage part;
            if (protocol::decode(message.bytes, part) == protocol::WireError::none) {
                samples += part.tail.size() / sizeof(Sample);
                part.tail = {};
                parts.push_back(part);
                known = true;
            }
            EXPECT_TRUE(known) << "the device sent bytes that are not a message";
        }
    }

    /// Result of the newest command; empty if it has not been acknowledged.
    [[nodiscard]] std::optional<protocol::AckResult> result() const {
        for (auto ack = acks.rbegin(); ack != acks.rend(); ++ack) {
            if (ack->request == request_) {
                return static_cast<protocol::AckResult>(ack->result);
            }
        }
        return std::nullopt;
    }
    [[nodiscard]] sim::MemoryPort& port() { return port_; }

    std::vector<protocol::AckMessage> acks;
    std::vector<protocol::PoseMessage> poses;
    std::vector<protocol::ColumnMessage> columns;
    std::vector<protocol::CheckMessage> checks;
    std::vector<protocol::IdentifyMessage> identities;
    std::vector<protocol::StatusMessage> statuses;
    std::vector<protocol::ConditionMessage> conditions;
    std::vector<protocol::ParametersMessage> parameters;
    std::vector<protocol::RawBlockMessage> parts;
    std::size_t samples = 0;
    std::vector<std::vector<std::uint8_t>> blobs;
    std::uint64_t heard = 0;

private:
    template <typename Message>
    bool keep(std::span<const std::uint8_t> bytes, std::vector<Message>& all) {
        Message m;
        if (protocol::decode(bytes, m) != protocol::WireError::none) {
            return false;
        }
        all.push_back(m);
        return true;
    }

    sim::MemoryPort port_;
    std::uint32_t sequence_ = 0;
    std::uint16_t request_ = 0;
    std::pair<protocol::CalibrationMessage, std::vector<std::uint8_t>> written_;
};

}  // namespace tricoil::test
