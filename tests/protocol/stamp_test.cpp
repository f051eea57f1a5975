// The stamp, a base class of all messages, survives encoding and decoding.
#include <gtest/gtest.h>

#include "core/protocol/codec.hpp"

namespace tricoil::protocol {
namespace {

template <typename Message>
class Stamps : public ::testing::Test {};
using Every =
    ::testing::Types<CommandMessage, AckMessage, StatusMessage, ColumnMessage, PoseMessage, IdentifyMessage, CheckMessage>;
TYPED_TEST_SUITE(Stamps, Every);

TYPED_TEST(Stamps, RoundTrip) {
    TypeParam sent;
    sent.sequence = 7;
    sent.time_us = 4167;
    if constexpr (requires { sent.opcode; }) {
        sent.opcode = 2;
    }
    if constexpr (requires { sent.count; }) {
        sent.count = 1;
    }
    if constexpr (requires { sent.sigma; }) {
        sent.sigma = {1e-6F, 1e-6F, 1e-6F};
        sent.state = 1;
    }
    std::array<std::uint8_t, kMaxFrameBytes> bytes{};
    const std::size_t size = encode(sent, bytes);
    TypeParam got;
    ASSERT_EQ(decode(std::span<const std::uint8_t>(bytes).first(size), got), WireError::none);
    EXPECT_EQ(got.sequence, 7U);
    EXPECT_EQ(got.time_us, 4167);
}

}  // namespace
}  // namespace tricoil::protocol
