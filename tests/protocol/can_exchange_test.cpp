// CAN exchange: host and device of one node.
#include "core/protocol/can_exchange.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

namespace tricoil::protocol {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kJustLongEnough = 1'000'001;  // us

struct End {
    explicit End(CanSide side) : exchange(side, 2) {}

    WireError send_due(std::int64_t now_us) {
        return exchange.send_due(now_us, [this](const CanFrame& frame) { return push(frame); });
    }
    CanArrival take(const CanFrame& frame, std::int64_t now_us) {
        return exchange.take(frame, true, now_us, message, [this](const CanFrame& f) { return push(f); });
    }
    bool push(const CanFrame& frame) {
        if (sent.size() >= room) {
            return false;
        }
        sent.push_back(frame);
        return true;
    }

    CanExchange<300, 3> exchange;
    std::deque<CanFrame> sent;
    std::size_t room = 100;
    std::span<const std::uint8_t> message;
};

TEST(CanExchange, CarriesLongMessagesBothWaysAtOnceThroughAQueueOfOne) {
    End host(CanSide::host);
    End device(CanSide::device);
    host.room = device.room = 1;
    const Bytes to_device(300, 1);
    const Bytes to_host(299, 2);
    ASSERT_TRUE(host.exchange.begin(to_device, 0));
    ASSERT_TRUE(device.exchange.begin(to_host, 0));
    EXPECT_FALSE(host.exchange.begin(to_device, 0)) << "one at a time";
    Bytes at_device;
    Bytes at_host;
    for (std::int64_t now_us = 0; now_us < 100'000; now_us += 1000) {
        for (auto [from, to, got] : {std::tuple{&host, &device, &at_device}, std::tuple{&device, &host, &at_host}}) {
            EXPECT_EQ(from->send_due(now_us), WireError::none);
            if (!from->sent.empty()) {
                const CanFrame frame = from->sent.front();
                from->sent.pop_front();
                if (to->take(frame, now_us).complete) {
                    got->assign(to->message.begin(), to->message.end());
                }
            }
        }
    }
    EXPECT_EQ(at_device, to_device);
    EXPECT_EQ(at_host, to_host);
    EXPECT_FALSE(host.exchange.begin(Bytes(301), 0)) << "too long";
}

TEST(CanExchange, DropsAbandonedMessages) {
    End host(CanSide::host);
    End device(CanSide::device);
    const Bytes message(200, 1);
    ASSERT_TRUE(host.exchange.begin(message, 0));
    EXPECT_EQ(host.send_due(0), WireError::none);
    EXPECT_EQ(device.take(host.sent.front(), 0).error, WireError::none);
    EXPECT_EQ(host.send_due(kJustLongEnough - 1), WireError::none);
    EXPECT_EQ(device.send_due(kJustLongEnough - 1), WireError::none);
    EXPECT_EQ(host.send_due(kJustLongEnough), WireError::bad_framing) << "no flow control came";
    EXPECT_EQ(device.send_due(kJustLongEnough), WireError::bad_framing) << "no segment came";
    EXPECT_EQ(host.send_due(2 * kJustLongEnough), WireError::none);
    EXPECT_EQ(device.send_due(2 * kJustLongEnough), WireError::none) << "reported once";
    EXPECT_FALSE(host.exchange.sending());
}

TEST(CanExchange, CountsAnInterruptedMessageAndAnswersTheNewOne) {
    End host(CanSide::host);
    End device(CanSide::device);
    for (const WireError expected : {WireError::none, WireError::bad_framing}) {
        ASSERT_TRUE(host.exchange.begin(Bytes(200, 1), 0));
        host.send_due(0);
        EXPECT_EQ(device.take(host.sent.front(), 0).error, expected);
        EXPECT_EQ(device.sent.front().data[0], 0x30) << "clear to send";
        host.exchange.reset();
        host.sent.clear();
        device.sent.clear();
    }
}

}  // namespace
}  // namespace tricoil::protocol
