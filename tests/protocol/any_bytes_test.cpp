// Random bytes into all decoders: no crash, no invalid message accepted.
#include <gtest/gtest.h>

#include "core/protocol/iso_tp.hpp"
#include "core/protocol/stream_framing.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::protocol {
namespace {

/// Returns the number of types that accept the bytes. An accepted message of the newest version must encode to the same bytes.
int decode_as_everything(std::span<const std::uint8_t> bytes) {
    int passed = 0;
    const auto as = [&](auto message) {
        if (decode(bytes, message) == WireError::none) {
            ++passed;
            const auto again = test::bytes_of(message);
            EXPECT_TRUE(std::equal(again.begin(), again.end(), bytes.begin() + 0, bytes.end()) || bytes[0] != kNewestVersion);
        }
    };
    as(CommandMessage{});
    as(AckMessage{});
    as(StatusMessage{});
    as(ColumnMessage{});
    as(PoseMessage{});
    as(IdentifyMessage{});
    as(CheckMessage{});
    as(RawBlockMessage{});
    as(CalibrationMessage{});
    as(ConditionMessage{});
    as(ParametersMessage{});
    return passed;
}

TEST(AnyBytes, MatchAtMostOneMessageType) {
    std::mt19937_64 random(21);
    int passed = 0;
    for (int i = 0; i < 20000; ++i) {
        auto bytes = test::random_bytes(random() % 130, random);
        if (bytes.size() > 1 && i % 2 == 0) {  // valid version, mostly valid type: more of the decoder runs
            bytes[0] = kNewestVersion;
            bytes[1] = static_cast<std::uint8_t>(random() % (kMaxMessageType + 2));
            bytes.resize(std::max<std::size_t>(2, size_of_type(bytes[1]).fixed), 0);
        }
        const int as = decode_as_everything(bytes);
        EXPECT_LE(as, 1);
        passed += as;
    }
    EXPECT_GT(passed, 100) << "too few messages were accepted to test the decoders";
}

TEST(AnyBytes, GoThroughStreamReaderAndReassembler) {
    std::mt19937_64 random(22);
    StreamReader reader;
    Reassembler segments;
    for (int i = 0; i < 200'000; ++i) {
        auto byte = static_cast<std::uint8_t>(random());
        byte = random() % 20 == 0 ? 0 : byte;
        if (reader.push(byte)) {
            EXPECT_LE(reader.message().size(), kMaxMessageBytes);
        }
    }
    for (int i = 0; i < 100'000; ++i) {
        auto data = test::random_bytes(random() % 65, random);
        if (!data.empty() && i % 4 != 0) {
            data[0] = static_cast<std::uint8_t>((data[0] & 0x0FU) | (random() % 8 == 0 ? 0x10U : 0x20U));
            data.resize(random() % 3 == 0 ? data.size() : 64, 1);
        }
        if (segments.on_frame(data) == SegmentEvent::complete) {
            EXPECT_LE(segments.message().size(), kMaxMessageBytes);
        }
    }
}

TEST(AnyBytes, InFramesOfRandomIdentifiers) {
    std::mt19937_64 random(23);
    for (int i = 0; i < 100'000; ++i) {
        CanFrame f;
        f.id = static_cast<std::uint32_t>(random());
        f.length = static_cast<std::uint8_t>(random());
        for (auto& byte : f.data) {
            byte = static_cast<std::uint8_t>(random() % 3);
        }
        std::span<const std::uint8_t> message;
        if (from_frame(f, message) == WireError::none) {
            decode_as_everything(message);
        }
    }
}

}  // namespace
}  // namespace tricoil::protocol
