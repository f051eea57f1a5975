// The queues between thread context and interrupt handlers.
#include <gtest/gtest.h>

#include <random>

#include "drivers/stm32g4/link/frame_queue.hpp"
#include "drivers/stm32g4/link/ring.hpp"
#include "tests/stm32g4/framed.hpp"

namespace tricoil::stm32g4 {
namespace {

using test::Bytes;

TEST(Ring, IsFullAfterItsLengthAndKeepsTheOrder) {
    Ring<std::uint8_t, 8> ring;
    std::uint8_t byte = 0;
    EXPECT_FALSE(ring.pop(byte));
    for (int round = 0; round < 5; ++round) {
        for (std::uint8_t i = 0; i < 8; ++i) {
            EXPECT_TRUE(ring.push(i));
        }
        EXPECT_FALSE(ring.push(9));
        EXPECT_EQ(ring.room(), 0U);
        for (std::uint8_t i = 0; i < 8; ++i) {
            EXPECT_TRUE(ring.pop(byte));
            EXPECT_EQ(byte, i);
        }
    }
}

TEST(FrameQueue, KeepsMessagesInOrderAndRefusesThoseThatDoNotFit) {
    std::mt19937 random(3);
    FrameQueue<300> queue;
    Bytes expected;
    Bytes sent;
    int refused = 0;
    for (int step = 0; step < 20'000; ++step) {
        Bytes message(1 + random() % 120);
        for (auto& byte : message) {
            byte = static_cast<std::uint8_t>(random() % 4);
        }
        if (queue.push(message)) {
            const Bytes stream = test::framed(message);
            expected.insert(expected.end(), stream.begin(), stream.end());
        } else {
            ++refused;
        }
        const auto waiting = queue.front();
        ASSERT_EQ(waiting.empty(), sent.size() == expected.size());
        const std::size_t count = waiting.empty() ? 0 : 1 + random() % waiting.size();
        sent.insert(sent.end(), waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(count));
        queue.pop(count);
        ASSERT_LE(expected.size() - sent.size(), 300U);
        ASSERT_TRUE(std::equal(sent.begin(), sent.end(), expected.begin()));
        ASSERT_TRUE(!queue.front().empty() || sent.size() == expected.size());
        if (step % 5000 == 4999) {
            queue.clear();
            EXPECT_TRUE(queue.front().empty());
            sent.clear();
            expected.clear();
        }
    }
    EXPECT_GT(refused, 1000);
    EXPECT_LT(refused, 15'000);
}

TEST(FrameQueue, TakesTheLongestMessageAtAnyPosition) {
    constexpr std::size_t kLongest = 40;
    for (std::size_t before = 1; before <= kLongest; ++before) {
        FrameQueue<FrameQueue<1>::bytes_for(kLongest)> queue;
        for (const std::size_t bytes : {before, kLongest, before, kLongest, kLongest}) {
            ASSERT_TRUE(queue.push(Bytes(bytes, 1))) << before;
            while (!queue.front().empty()) {
                queue.pop(1);
            }
        }
    }
}

}  // namespace
}  // namespace tricoil::stm32g4
