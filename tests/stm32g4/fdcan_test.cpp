// The CAN port with plain structures as registers: bit timing, message RAM, exchanges with a host, bus-off.
#include "drivers/stm32g4/fdcan/fdcan_port.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <optional>
#include <random>

#include "drivers/stm32g4/fdcan/bit_timing.hpp"
#include "tests/stm32g4/framed.hpp"
#include "tests/stm32g4/stepping_clock.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace fdcan;
using protocol::CanFrame;
using test::Bytes;

constexpr std::uint8_t kNode = 3;

TEST(BitTiming, DividesExactlyAndSamplesAtThreeQuarters) {
    const BitTiming nominal = bit_timing(170'000'000, 1'000'000, kNominalLimits);
    EXPECT_EQ(nominal.prescaler, 1U);
    EXPECT_EQ(nominal.segment_1, 127U);
    EXPECT_EQ(nominal.segment_2, 42U);
    EXPECT_EQ(nominal.jump, 42U);
    const BitTiming data = bit_timing(170'000'000, 5'000'000, kDataLimits);
    EXPECT_EQ(data.prescaler, 1U);
    EXPECT_EQ(data.segment_1, 25U);
    EXPECT_EQ(data.segment_2, 8U);
    EXPECT_EQ(data.jump, 8U);
}

TEST(BitTiming, IsExactOrRefusedForEveryClock) {
    for (const std::uint32_t clock :
         {8'000'000U, 24'000'000U, 40'000'000U, 80'000'000U, 85'000'000U, 160'000'000U, 170'000'000U}) {
        for (const std::uint32_t rate : {125'000U, 500'000U, 1'000'000U}) {
            const BitTiming t = bit_timing(clock, rate, kNominalLimits);
            ASSERT_NE(t.prescaler, 0U) << clock << ' ' << rate;
            EXPECT_EQ(std::uint64_t{rate} * t.prescaler * (1 + t.segment_1 + t.segment_2), clock);
            EXPECT_NEAR((1.0 + t.segment_1) / (1.0 + t.segment_1 + t.segment_2), 0.75, 0.07);
        }
    }
    EXPECT_EQ(bit_timing(24'000'000, 5'000'000, kDataLimits).prescaler, 0U) << "no whole quanta";
    EXPECT_EQ(bit_timing(20'000'000, 5'000'000, kDataLimits).prescaler, 0U) << "too few quanta";
    EXPECT_EQ(bit_timing(170'000'000, 125'000, kDataLimits).prescaler, 0U) << "more quanta than the data phase has";
    EXPECT_EQ(bit_timing(170'000'000, 0, kNominalLimits).prescaler, 0U);
}

class Fdcan : public testing::Test {
protected:
    void SetUp() override {
        registers_.CCCR = CCCR_INIT;
        ASSERT_TRUE(port_.open().ok()) << port_.detail();
        registers_.TXFQS = 3;
        registers_.IR = 0;
    }

    /// The next frame that the port gives to the controller; frames use three buffers in turn.
    std::optional<CanFrame> transmitted() {
        registers_.TXBAR = 0;
        registers_.TXFQS = 3 | put_ << TXFQS_TFQPI_Pos;
        registers_.RXF0S = 0;
        port_.on_interrupt();
        if (registers_.TXBAR == 0) {
            return {};
        }
        EXPECT_EQ(registers_.TXBAR, 1U << put_);
        const FdcanElement& element = ram_.tx_buffers[put_];
        put_ = (put_ + 1) % 3;
        EXPECT_EQ(element.R0 & ~(0x7FFU << 18U), 0U) << "a standard data frame";
        EXPECT_EQ(element.R1 & ~(0xFU << 16U), R1_FDF | R1_BRS);
        constexpr std::array<std::uint8_t, 16> kLengths{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
        CanFrame frame;
        frame.id = element.R0 >> 18U;
        frame.length = kLengths[element.R1 >> 16U & 0xFU];
        for (std::size_t i = 0; i < frame.length; ++i) {
            frame.data[i] = static_cast<std::uint8_t>(element.data[i / 4] >> 8 * (i % 4));
        }
        return frame;
    }

    /// A frame that passed the filter, in the next element of FIFO 0.
    void arrive(const CanFrame& frame, std::uint32_t extra_0 = 0, std::uint32_t format = R1_FDF | R1_BRS) {
        FdcanElement& element = ram_.rx_fifo_0[get_];
        std::uint32_t code = 0;
        while (code < 15 &&
               protocol::can_fd_length(frame.length) > std::array{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64}[code]) {
            ++code;
        }
        element.R0 = frame.id << 18U | extra_0;
        element.R1 = code << 16U | format | 0x1234U;  // a time stamp in the lower half
        for (std::size_t i = 0; i < 64; ++i) {
            element.data[i / 4] = i % 4 == 0 ? 0U : std::uint32_t{element.data[i / 4]};
            element.data[i / 4] = element.data[i / 4] | std::uint32_t{frame.data[i]} << 8 * (i % 4);
        }
        registers_.RXF0S = 1 | get_ << 8U;
        registers_.RXF0A = 99;
        registers_.TXFQS = TXFQS_TFQF;
        port_.on_interrupt();
        EXPECT_EQ(registers_.RXF0A, get_) << "acknowledged";
        registers_.RXF0S = 0;
        get_ = (get_ + 1) % 3;
    }

    static Bytes command() {
        Bytes message(22, 1);
        message[0] = protocol::kNewestVersion;
        message[1] = 1;
        return message;
    }
    static CanFrame frame_of(const Bytes& message) {
        CanFrame frame;
        EXPECT_TRUE(protocol::to_frame(message, kNode, frame));
        return frame;
    }

    FdcanRegisters registers_{};
    FdcanMessageRam ram_{};
    NvicRegisters nvic_{};
    test::SteppingClock clock_;
    FdcanPort port_{registers_, ram_, {nvic_, kFdcan2Interrupt0}, clock_, {.node = kNode}};
    std::uint32_t put_ = 0;
    std::uint32_t get_ = 0;
};

TEST_F(Fdcan, ConfiguresTimingDelayFilterAndInterrupts) {
    EXPECT_EQ(registers_.CCCR, CCCR_FDOE | CCCR_BRSE);
    EXPECT_EQ(registers_.NBTP, 41U << 25U | 0U << 16U | 126U << 8U | 41U);
    EXPECT_EQ(registers_.DBTP, 1U << 23U | 0U << 16U | 24U << 8U | 7U << 4U | 7U);
    EXPECT_EQ(registers_.TDCR, 26U << 8U);
    EXPECT_EQ(registers_.RXGFC, 1U << 16U | 2U << 4U | 2U << 2U | 3U);
    EXPECT_EQ(ram_.standard_filters[0], 1U << 30U | 1U << 27U | 0x113U << 16U | 0x1F3U);
    EXPECT_EQ(ram_.standard_filters[1], 0U);
    EXPECT_EQ(registers_.ILE, 1U);
    EXPECT_EQ(registers_.ILS, 0U);
    EXPECT_EQ(registers_.TXBTIE, 7U);
    EXPECT_EQ(registers_.TXBC, 0U);
}

TEST_F(Fdcan, RefusesAClockWithoutWholeQuanta) {
    FdcanPort port(registers_, ram_, {nvic_, kFdcan2Interrupt0}, clock_, {.kernel_clock_hz = 24'000'000});
    EXPECT_EQ(port.open().code(), StatusCode::device_lost);
    EXPECT_NE(std::string(port.detail()).find("quanta"), std::string::npos);
}

TEST_F(Fdcan, SendsOneFramePerMessageWithPadding) {
    for (const std::size_t bytes : {2U, 5U, 8U, 9U, 22U, 33U, 58U, 64U}) {
        Bytes message(bytes, 0xA5);
        message[1] = 5;
        nvic_.ISPR[2] = 0;
        ASSERT_TRUE(port_.send(message).ok());
        EXPECT_EQ(nvic_.ISPR[2], 1U << 22U) << "interrupt 86 is pended";
        const auto frame = transmitted();
        ASSERT_TRUE(frame.has_value());
        EXPECT_EQ(frame->id, 0x153U);
        EXPECT_EQ(frame->length, protocol::can_fd_length(bytes));
        EXPECT_TRUE(std::equal(message.begin(), message.end(), frame->data.begin()));
        EXPECT_FALSE(transmitted().has_value());
    }
}

TEST_F(Fdcan, RefusesWhenFullAndRecovers) {
    const Bytes message(30, 5);
    registers_.TXFQS = TXFQS_TFQF;
    for (int i = 0; i < 4; ++i) {
        EXPECT_TRUE(port_.send(message).ok());
        port_.on_interrupt();
    }
    EXPECT_EQ(port_.send(message).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.counters().send_queue_full, 1U);
    for (int i = 0; i < 4; ++i) {
        EXPECT_TRUE(transmitted().has_value());
    }
    EXPECT_TRUE(port_.send(message).ok());
    EXPECT_EQ(port_.send(Bytes(kBoardMessageBytes + 1)).code(), StatusCode::invalid_argument);
    EXPECT_EQ(port_.send(Bytes(1)).code(), StatusCode::invalid_argument);
}

TEST_F(Fdcan, ReceivesCommandsAndRefusesDamagedFrames) {
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    arrive(frame_of(command()));
    EXPECT_TRUE(port_.wait(Microseconds{10}).ok());
    ASSERT_TRUE(port_.receive(message).ok());
    EXPECT_EQ(Bytes(message.bytes.begin(), message.bytes.end()), command());

    CanFrame wrong = frame_of(command());
    wrong.data[23] = 1;  // in the padding
    arrive(wrong);
    arrive(frame_of(command()), 0, 0);  // a classic frame cannot have 24 bytes
    arrive(frame_of(command()), R0_RTR);
    arrive(frame_of(command()), R0_XTD);
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.wire_errors().of(protocol::WireError::wrong_length), 2U);
    EXPECT_EQ(port_.wait(Microseconds{10}).code(), StatusCode::timed_out);
}

TEST_F(Fdcan, TakesOneFramePerInterrupt) {
    nvic_.ISPR[2] = 0;
    ram_.rx_fifo_0[0].R0 = 0x113U << 18U;
    registers_.RXF0S = 2;
    port_.on_interrupt();
    EXPECT_NE(nvic_.ISPR[2], 0U);
    nvic_.ISPR[2] = 0;
    registers_.RXF0S = 1;
    port_.on_interrupt();
    EXPECT_EQ(nvic_.ISPR[2], 0U);
}

TEST_F(Fdcan, AFloodIsCountedAndRecoveredFrom) {
    for (int i = 0; i < 20; ++i) {
        arrive(frame_of(command()));
    }
    registers_.IR = IR_RF0L;
    port_.on_interrupt();
    EXPECT_EQ(registers_.IR, IR_RF0L) << "cleared by writing one";
    hal::ReceivedMessage message;
    int received = 0;
    while (port_.receive(message).ok()) {
        ++received;
    }
    EXPECT_EQ(received, 8);
    EXPECT_EQ(port_.counters().receive_dropped, 13U);
}

TEST_F(Fdcan, LongMessagesGoBothWaysByIsoTp) {
    protocol::CanExchange<protocol::kMaxMessageBytes> host(protocol::CanSide::host, kNode);
    std::deque<CanFrame> to_device;
    const auto send = [&](const CanFrame& frame) {
        to_device.push_back(frame);
        return true;
    };
    for (const std::size_t bytes : {65U, 200U, 528U, 544U}) {
        Bytes message(bytes);
        for (std::size_t i = 0; i < bytes; ++i) {
            message[i] = static_cast<std::uint8_t>(i * 7);
        }
        ASSERT_TRUE(host.begin(message, 0));
        ASSERT_TRUE(port_.send(message).ok());
        Bytes from_host;
        Bytes from_device;
        for (int round = 0; round < 60; ++round) {
            host.send_due(0, send);
            if (!to_device.empty()) {
                arrive(to_device.front());
                to_device.pop_front();
            }
            hal::ReceivedMessage received;
            if (port_.receive(received).ok()) {
                from_host.assign(received.bytes.begin(), received.bytes.end());
            }
            clock_.advance(Microseconds{1000});
            std::span<const std::uint8_t> whole;
            if (const auto frame = transmitted(); frame && host.take(*frame, true, 0, whole, send).complete) {
                from_device.assign(whole.begin(), whole.end());
            }
        }
        EXPECT_EQ(from_host, message) << bytes;
        EXPECT_EQ(from_device, message) << bytes;
    }
    EXPECT_EQ(port_.wire_errors().total(), 0U);
}

TEST_F(Fdcan, ALongMessageWithoutReceiverIsDroppedAfterASecond) {
    const Bytes message(100, 1);
    ASSERT_TRUE(port_.send(message).ok());
    EXPECT_EQ(port_.send(message).code(), StatusCode::not_ready) << "one at a time";
    clock_.advance(Microseconds{1'100'000});
    hal::ReceivedMessage received;
    EXPECT_EQ(port_.receive(received).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.wire_errors().of(protocol::WireError::bad_framing), 1U);
    EXPECT_TRUE(port_.send(message).ok());
}

TEST_F(Fdcan, BusOffIsReportedAndLeftAfterAPause) {
    ASSERT_TRUE(port_.send(Bytes(30, 5)).ok());
    registers_.CCCR = CCCR_INIT | CCCR_FDOE | CCCR_BRSE;  // as the controller does
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    EXPECT_NE(std::string(port_.detail()).find("bus-off"), std::string::npos);
    EXPECT_EQ(port_.counters().link_faults, 1U);
    EXPECT_EQ(port_.send(Bytes(30, 5)).code(), StatusCode::not_ready);
    clock_.advance(Microseconds{50'000});
    (void)port_.receive(message);
    EXPECT_NE(registers_.CCCR & CCCR_INIT, 0U) << "too early";
    clock_.advance(Microseconds{60'000});
    (void)port_.receive(message);
    EXPECT_EQ(registers_.CCCR, CCCR_FDOE | CCCR_BRSE);
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    EXPECT_STREQ(port_.detail(), "");
    EXPECT_TRUE(port_.send(Bytes(30, 6)).ok());
    const auto frame = transmitted();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->data[0], 6) << "frames from before bus-off are dropped";
    EXPECT_FALSE(transmitted().has_value());
    EXPECT_EQ(port_.counters().link_faults, 1U);
}

TEST_F(Fdcan, SurvivesRandomFrames) {
    std::mt19937 random(8);
    hal::ReceivedMessage message;
    for (int i = 0; i < 50'000; ++i) {
        CanFrame frame;
        frame.id = random() % 2 == 0 ? 0x113 : 0x1F3;
        frame.length = protocol::can_fd_length(random() % 65);
        for (auto& byte : frame.data) {
            byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 3);
        }
        frame.data[0] = static_cast<std::uint8_t>(random() % 3 == 0 ? 0x10 + random() % 3 : (random() % 4) << 4U | random() % 16);
        arrive(frame, 0, random() % 8 == 0 ? 0 : R1_FDF | R1_BRS);
        while (port_.receive(message).ok()) {
            ASSERT_LE(message.bytes.size(), kBoardMessageBytes);
        }
        (void)transmitted();
        clock_.advance(Microseconds{static_cast<std::int64_t>(random() % 2000)});
    }
    EXPECT_GT(port_.wire_errors().total(), 1000U);
    clock_.advance(Microseconds{2'000'000});
    (void)port_.receive(message);
    while (transmitted().has_value()) {
    }
    arrive(frame_of(command()));
    EXPECT_TRUE(port_.receive(message).ok());
    EXPECT_TRUE(port_.send(Bytes(64, 5)).ok());
    EXPECT_TRUE(transmitted().has_value());
}

TEST_F(Fdcan, ClosesWithInterruptsOff) {
    port_.close();
    EXPECT_EQ(registers_.IE, 0U);
    EXPECT_EQ(registers_.CCCR, CCCR_INIT);
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::device_lost);
    EXPECT_EQ(port_.send(Bytes(30, 5)).code(), StatusCode::device_lost);
    EXPECT_EQ(port_.wait(Microseconds{1}).code(), StatusCode::device_lost);
}

}  // namespace
}  // namespace tricoil::stm32g4
