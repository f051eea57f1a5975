#include "core/protocol/can_mapping.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/random_messages.hpp"

namespace tricoil::protocol {
namespace {

TEST(CanMapping, RoundTripRemovesThePadding) {
    std::mt19937_64 random(3);
    const auto check = [&](const auto& message) {
        const auto bytes = test::bytes_of(message);
        CanFrame frame;
        ASSERT_TRUE(to_frame(bytes, 5, frame));
        EXPECT_EQ(frame.id & 0x70FU, 0x105U) << "base and node";
        EXPECT_GE(frame.length, bytes.size());
        std::span<const std::uint8_t> found;
        ASSERT_EQ(from_frame(frame, found), WireError::none);
        EXPECT_TRUE(std::equal(found.begin(), found.end(), bytes.begin(), bytes.end()));
    };
    check(test::random_message<CommandMessage>(random));
    check(test::random_message<AckMessage>(random));
    check(test::random_message<StatusMessage>(random));
    check(test::random_message<ColumnMessage>(random));
    check(test::random_message<PoseMessage>(random));
    check(test::random_message<IdentifyMessage>(random));
    check(test::random_message<CheckMessage>(random));
    CanFrame frame;
    EXPECT_FALSE(to_frame(std::vector<std::uint8_t>(65), 0, frame)) << "longer than a frame";
}

TEST(CanMapping, LengthsAreValidForCanFd) {
    EXPECT_EQ(can_fd_length(0), 0);
    EXPECT_EQ(can_fd_length(8), 8);
    EXPECT_EQ(can_fd_length(9), 12);
    EXPECT_EQ(can_fd_length(33), 48);
    EXPECT_EQ(can_fd_length(49), 64);
    EXPECT_EQ(can_fd_length(64), 64);
}

TEST(CanMapping, RefusesForeignPaddingLengthAndIdentifiers) {
    const auto bytes = test::bytes_of(CommandMessage{});  // 22 bytes in 24
    CanFrame good;
    ASSERT_TRUE(to_frame(bytes, 1, good));
    std::span<const std::uint8_t> found;
    CanFrame frame = good;
    frame.data[23] = 1;
    EXPECT_EQ(from_frame(frame, found), WireError::wrong_length);
    frame = good;
    frame.length = 32;
    EXPECT_EQ(from_frame(frame, found), WireError::wrong_length);
    frame = good;
    frame.length = 20;
    EXPECT_EQ(from_frame(frame, found), WireError::wrong_length);
    frame = good;
    frame.id = can_id(MessageType::pose, 1);
    EXPECT_EQ(from_frame(frame, found), WireError::wrong_sender);
    frame = good;
    frame.length = 1;
    EXPECT_EQ(from_frame(frame, found), WireError::too_short);
    frame = good;
    frame.length = 255;
    EXPECT_NE(from_frame(frame, found), WireError::none) << "longer than the array that holds it";
}

}  // namespace
}  // namespace tricoil::protocol
