// Bit-exact round trips; invalid messages are refused.
#include "core/protocol/codec.hpp"

#include <gtest/gtest.h>

#include "core/protocol/negotiation.hpp"
#include "core/protocol/sequence_check.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::protocol {
namespace {

constexpr std::uint64_t kSeed = 7;

template <typename Message>
class EveryMessage : public ::testing::Test {};
using Messages = ::testing::Types<CommandMessage, AckMessage, StatusMessage, ColumnMessage, PoseMessage, IdentifyMessage,
                                  CheckMessage, RawBlockMessage, CalibrationMessage, ConditionMessage, ParametersMessage>;
TYPED_TEST_SUITE(EveryMessage, Messages);

TYPED_TEST(EveryMessage, RoundTripsExactly) {
    std::mt19937_64 random(kSeed);
    for (int i = 0; i < 2000; ++i) {
        TypeParam sent = test::random_message<TypeParam>(random);
        const auto tail = test::random_bytes(16 * (random() % 9), random);
        if constexpr (Schema<TypeParam>::kInfo.tail_unit > 0) {
            sent.tail = tail;
        }
        const auto bytes = test::bytes_of(sent);
        ASSERT_EQ(bytes.size(), encoded_bytes(sent));
        TypeParam received;
        ASSERT_EQ(decode(std::span<const std::uint8_t>(bytes), received), WireError::none) << Schema<TypeParam>::kInfo.name;
        EXPECT_EQ(test::bytes_of(received), bytes);
        EXPECT_EQ(received.sequence, sent.sequence);
        EXPECT_EQ(received.time_us, sent.time_us);
    }
}

TYPED_TEST(EveryMessage, OfAWrongLengthVersionOrTypeIsRefused) {
    std::mt19937_64 random(kSeed);
    const auto bytes = test::bytes_of(test::random_message<TypeParam>(random));
    TypeParam m;
    for (std::size_t length = 0; length < bytes.size(); ++length) {
        EXPECT_NE(decode(std::span(bytes).first(length), m), WireError::none) << length;
    }
    auto longer = bytes;
    longer.resize(bytes.size() + 16 * 300, 0);
    EXPECT_NE(decode(std::span<const std::uint8_t>(longer), m), WireError::none);
    auto changed = bytes;
    changed[0] = kNewestVersion + 1;
    EXPECT_EQ(decode(std::span<const std::uint8_t>(changed), m), WireError::unknown_version);
    changed = bytes;
    changed[1] = kMaxMessageType + 1;
    EXPECT_EQ(decode(std::span<const std::uint8_t>(changed), m), WireError::unknown_type);
}

TYPED_TEST(EveryMessage, RefusesEveryNumberOutsideItsRange) {
    std::mt19937_64 random(kSeed);
    const auto bytes = test::bytes_of(test::random_message<TypeParam>(random));
    for_each_field(Schema<TypeParam>{}, [&](const char* name, const FieldInfo& f, std::size_t at) {
        const double step = std::max(1.0, std::nextafter(f.high, 1e300) - f.high);  // the next representable double
        for (const double beyond : {f.low - 1, f.high + step}) {
            if (f.type == WireType::f32 || beyond < lowest(f.type) || beyond > highest(f.type)) {
                continue;
            }
            auto changed = bytes;
            put(changed.data() + at, f.type, static_cast<std::int64_t>(beyond));
            TypeParam m;
            EXPECT_EQ(decode(std::span<const std::uint8_t>(changed), m), WireError::impossible) << name << ' ' << beyond;
        }
        if (f.type == WireType::f32) {
            for (const std::uint32_t bits : {0x7FC00000U, 0x7F800000U, 0xFF800000U}) {  // NaN and both infinities
                auto changed = bytes;
                put_bytes(changed.data() + at, bits, 4);
                TypeParam m;
                EXPECT_EQ(decode(std::span<const std::uint8_t>(changed), m), WireError::impossible) << name;
            }
        }
    });
}

TEST(Codec, EncodesNumbersAsTheSchemaStates) {
    CommandMessage m;
    m.sequence = 0x04030201;
    m.time_us = 0x0C0B0A0908070605;
    m.opcode = 5;
    m.state = 3;
    m.request = 0x2221;
    m.argument = 0x34333231;
    const std::vector<std::uint8_t> expected{3,    1,    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09,
                                             0x0A, 0x0B, 0x0C, 5,    3,    0x21, 0x22, 0x31, 0x32, 0x33, 0x34};
    EXPECT_EQ(test::bytes_of(m), expected);
}

TEST(Codec, WritesNothingIntoATooSmallBuffer) {
    std::array<std::uint8_t, 63> small{};
    EXPECT_EQ(encode(PoseMessage{}, small), 0U);
    const std::vector<std::uint8_t> tail(kMaxMessageBytes);
    CalibrationMessage m;
    m.tail = tail;
    std::vector<std::uint8_t> out(2 * kMaxMessageBytes);
    EXPECT_EQ(encode(m, out), 0U) << "too long";
}

TEST(Codec, SignExtendsThreeBytes) {
    std::array<std::uint8_t, 3> bytes{};
    for (const int value : {0, 1, -1, 8388607, -8388608, -77}) {
        put(bytes.data(), WireType::i24, value);
        EXPECT_EQ(get<std::int32_t>(bytes.data(), WireType::i24), value);
    }
}

TEST(Schema, NamesAndNumbersAreUnique) {
    std::vector<std::string> names;
    std::vector<int> numbers;
    for_each_message([&](auto schema) {
        names.emplace_back(schema.kInfo.name);
        numbers.push_back(static_cast<int>(schema.kInfo.type));
        std::vector<std::string> fields;
        for_each_field(schema, [&](const char* name, const FieldInfo& f, std::size_t) {
            fields.emplace_back(name);
            EXPECT_LT(f.low, f.high + (f.low == f.high ? 1 : 0)) << name;
            EXPECT_GE(f.low, lowest(f.type)) << name;
            EXPECT_LE(f.high, highest(f.type)) << name;
        });
        std::sort(fields.begin(), fields.end());
        EXPECT_EQ(std::adjacent_find(fields.begin(), fields.end()), fields.end()) << schema.kInfo.name;
    });
    std::sort(names.begin(), names.end());
    EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
    EXPECT_EQ(std::adjacent_find(numbers.begin(), numbers.end(), std::greater_equal<>()), numbers.end()) << "not in order";
    EXPECT_GE(numbers.front(), 1);
    EXPECT_EQ(numbers.back(), kMaxMessageType);
}

TEST(Negotiation, TakesTheNewestCommonVersion) {
    EXPECT_EQ(common_version({1, 3}, {2, 5}), 3);
    EXPECT_EQ(common_version({1, 1}, {1, 9}), 1);
    EXPECT_EQ(common_version({1, 1}, {2, 5}), 0);
    EXPECT_EQ(common_version({5, 2}, {1, 9}), 0) << "oldest above newest";
    const VersionRange range = range_of_hello(hello_argument({2, 7}));
    EXPECT_EQ(range.oldest, 2);
    EXPECT_EQ(range.newest, 7);
}

TEST(SequenceCheck, CountsGapsAndDetectsOldNumbersAcrossTheWrap) {
    SequenceCheck check;
    EXPECT_EQ(check.check(0xFFFFFFFE), Order::next);
    EXPECT_EQ(check.check(0xFFFFFFFF), Order::next);
    EXPECT_EQ(check.check(2), Order::gap);
    EXPECT_EQ(check.lost(), 2U);
    EXPECT_EQ(check.check(1), Order::old);
    EXPECT_EQ(check.check(2), Order::old) << "the same number twice";
    EXPECT_EQ(check.check(1'000'000), Order::strange);
    EXPECT_EQ(check.check(3), Order::next);
    check.restart();
    EXPECT_EQ(check.check(1'000'000), Order::next);
    EXPECT_EQ(check.lost(), 2U);
}

}  // namespace
}  // namespace tricoil::protocol
