#include "core/protocol/iso_tp.hpp"

#include <gtest/gtest.h>

#include "tests/protocol/random_messages.hpp"

namespace tricoil::protocol {
namespace {

using Data = std::array<std::uint8_t, kMaxFrameBytes>;
using Reassembler = BasicReassembler<kMaxMessageBytes>;

/// Transfers one message with `flow` as flow control. Returns the received message, empty if it was dropped.
std::vector<std::uint8_t> carry(Segmenter& from, Reassembler& to, std::span<const std::uint8_t> flow) {
    Data data{};
    for (int frames = 0; frames < 200; ++frames) {
        const std::size_t length = from.next(data);
        if (length == 0) {
            if (!from.waits()) {
                return {};
            }
            from.on_flow_control(flow);
            continue;
        }
        if (to.on_frame(std::span(data).first(length)) == SegmentEvent::complete) {
            return {to.message().begin(), to.message().end()};
        }
    }
    return {};
}

TEST(IsoTp, CarriesEveryLengthFromAFrameToTheLongest) {
    std::mt19937_64 random(11);
    Segmenter from;
    Reassembler to;
    for (std::size_t bytes = kMaxFrameBytes + 1; bytes <= kMaxMessageBytes; bytes += 1 + random() % 37) {
        const auto message = test::random_bytes(bytes, random);
        ASSERT_TRUE(from.begin(message));
        ASSERT_EQ(carry(from, to, Reassembler::flow_control()), message) << bytes;
        ASSERT_FALSE(from.busy());
    }
    const auto longest = test::random_bytes(kMaxMessageBytes, random);
    ASSERT_TRUE(from.begin(longest));
    EXPECT_EQ(carry(from, to, std::array<std::uint8_t, 3>{0x30, 3, 0xF5}), longest) << "three frames at a time";
    EXPECT_EQ(from.gap_us(), 500U);
}

TEST(IsoTp, AcceptsOneLongMessageAtATime) {
    const std::vector<std::uint8_t> message(100);
    const std::vector<std::uint8_t> longer(kMaxMessageBytes + 1);
    Segmenter s;
    EXPECT_FALSE(s.begin(std::span(message).first(64)));
    EXPECT_FALSE(s.begin(longer));
    EXPECT_TRUE(s.begin(message));
    EXPECT_FALSE(s.begin(message));
    Data data{};
    EXPECT_EQ(s.next(data), 64U);
    EXPECT_EQ(s.next(data), 0U) << "flow control must come first";
    s.on_flow_control(std::array<std::uint8_t, 3>{0x31, 0, 0});
    EXPECT_TRUE(s.waits()) << "wait";
    s.on_flow_control(std::array<std::uint8_t, 3>{0x32, 0, 0});
    EXPECT_FALSE(s.busy()) << "overflow";
}

TEST(IsoTp, DropsIncompleteMessages) {
    std::mt19937_64 random(12);
    const auto message = test::random_bytes(500, random);
    for (int lost = 1; lost < 8; ++lost) {
        Segmenter from;
        Reassembler to;
        ASSERT_TRUE(from.begin(message));
        Data data{};
        SegmentEvent last = SegmentEvent::none;
        bool error = false;
        for (int n = 0; from.busy(); ++n) {
            const std::size_t length = from.next(data);
            from.on_flow_control(Reassembler::flow_control());
            if (length > 0 && n != lost) {
                last = to.on_frame(std::span(data).first(length));
                error = error || last == SegmentEvent::error;
            }
        }
        EXPECT_NE(last, SegmentEvent::complete) << lost;
        ASSERT_TRUE(from.begin(message));
        EXPECT_EQ(carry(from, to, Reassembler::flow_control()), message)
            << "the next message must be complete; lost frame " << lost;
    }
}

TEST(IsoTp, AFirstFrameInTheMiddleBeginsANewMessage) {
    const std::vector<std::uint8_t> message(200, 1);
    Segmenter from;
    Reassembler to;
    Data data{};
    for (const SegmentEvent expected : {SegmentEvent::answer, SegmentEvent::answer_anew}) {
        ASSERT_TRUE(from.begin(message));
        EXPECT_EQ(to.on_frame(std::span(data).first(from.next(data))), expected);
        from.cancel();
    }
}

TEST(IsoTp, ASmallReassemblerRefusesALongerMessageAtItsFirstFrame) {
    Segmenter from;
    BasicReassembler<200> to;
    Data data{};
    const std::vector<std::uint8_t> fits(200, 1);
    const std::vector<std::uint8_t> longer(201, 1);
    ASSERT_TRUE(from.begin(longer));
    std::size_t length = from.next(data);
    EXPECT_EQ(to.on_frame(std::span(data).first(length)), SegmentEvent::error);
    from.cancel();
    ASSERT_TRUE(from.begin(fits));
    length = from.next(data);
    EXPECT_EQ(to.on_frame(std::span(data).first(length)), SegmentEvent::answer);
}

}  // namespace
}  // namespace tricoil::protocol
