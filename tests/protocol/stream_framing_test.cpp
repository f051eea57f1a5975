#include "core/protocol/stream_framing.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/random_messages.hpp"

namespace tricoil::protocol {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes framed(const Bytes& message) {
    Bytes out(framed_bytes(message.size()));
    out.resize(frame(message, out));
    return out;
}

std::vector<Bytes> read_all(StreamReader& reader, const Bytes& stream, int* errors = nullptr) {
    std::vector<Bytes> messages;
    for (const std::uint8_t byte : stream) {
        if (reader.push(byte)) {
            messages.emplace_back(reader.message().begin(), reader.message().end());
        } else if (errors != nullptr && reader.error() != WireError::none) {
            ++*errors;
        }
    }
    return messages;
}

TEST(StreamFraming, CarriesEveryLengthAndAnyBytes) {
    std::mt19937_64 random(5);
    StreamReader reader;
    for (std::size_t bytes = 1; bytes <= kMaxMessageBytes; bytes += bytes < 600 ? 1 : 97) {
        for (const int kind : {0, 1, 2}) {  // random; zeros; no zeros
            Bytes message = test::random_bytes(bytes, random);
            for (auto& b : message) {
                b = kind == 1 ? 0 : kind == 2 ? b | 1 : b;
            }
            const Bytes stream = framed(message);
            ASSERT_FALSE(stream.empty());
            ASSERT_EQ(std::count(stream.begin(), stream.end(), 0), 1);
            const auto read = read_all(reader, stream);
            ASSERT_EQ(read.size(), 1U) << bytes;
            ASSERT_EQ(read[0], message);
        }
    }
    EXPECT_TRUE(framed({}).empty());
    EXPECT_TRUE(framed(Bytes(kMaxMessageBytes + 1)).empty());
}

TEST(StreamFraming, OneDamagedByteLosesAtMostTwoMessages) {
    std::mt19937_64 random(6);
    for (int trial = 0; trial < 3000; ++trial) {
        std::vector<Bytes> sent;
        Bytes stream;
        for (int n = 0; n < 4; ++n) {
            sent.push_back(test::random_bytes(1 + random() % 80, random));
            const Bytes one = framed(sent.back());
            stream.insert(stream.end(), one.begin(), one.end());
        }
        stream[random() % stream.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
        StreamReader reader;
        const auto read = read_all(reader, stream);
        EXPECT_GE(read.size(), 2U);
        for (const Bytes& message : read) {
            EXPECT_NE(std::find(sent.begin(), sent.end(), message), sent.end());
        }
    }
}

TEST(StreamFraming, ReportsTheKindOfError) {
    StreamReader reader;
    const auto error_of = [&](const Bytes& stream) {
        WireError error = WireError::none;
        for (const std::uint8_t byte : stream) {
            reader.push(byte);
            error = reader.error() != WireError::none ? reader.error() : error;
        }
        return error;
    };
    EXPECT_EQ(error_of({0, 0, 0}), WireError::none);
    EXPECT_EQ(error_of({9, 1, 0}), WireError::bad_framing);
    EXPECT_EQ(error_of({3, 1, 1, 0}), WireError::too_short);
    EXPECT_EQ(error_of({7, 1, 1, 1, 1, 1, 1, 0}), WireError::bad_crc);
    Bytes endless(3 * kMaxFramedBytes, 1);
    endless.push_back(0);
    EXPECT_EQ(error_of(endless), WireError::oversize);
    Bytes good = framed({1, 2, 3});
    EXPECT_EQ(error_of(good), WireError::none);
}

TEST(StreamFraming, ASmallReaderResynchronisesAfterATooLongMessage) {
    BasicStreamReader<64> reader;
    const auto push_all = [&reader](const Bytes& stream) {
        bool complete = false;
        for (const std::uint8_t byte : stream) {
            complete = reader.push(byte);
        }
        return complete;
    };
    EXPECT_TRUE(push_all(framed(Bytes(64, 7))));
    EXPECT_FALSE(push_all(framed(Bytes(80, 7))));
    EXPECT_EQ(reader.error(), WireError::oversize);
    EXPECT_TRUE(push_all(framed(Bytes(64, 0))));
}

}  // namespace
}  // namespace tricoil::protocol
