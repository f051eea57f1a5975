// The serial port with a plain structure as registers: register writes, reception, errors and floods.
#include "drivers/stm32g4/usart/usart_port.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/stm32g4/framed.hpp"
#include "tests/stm32g4/stepping_clock.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usart;
using test::Bytes;

constexpr std::uint32_t kReady = ISR_TEACK | ISR_REACK;

class Usart : public testing::Test {
protected:
    void open() {
        registers_.ISR = kReady;
        ASSERT_TRUE(port_.open().ok()) << port_.detail();
    }

    void receive(std::uint8_t byte, std::uint32_t errors = 0) {
        registers_.RDR = byte;
        registers_.ISR = kReady | ISR_RXFNE | errors;
        port_.on_interrupt();
        registers_.ISR = kReady;
    }
    void receive(const Bytes& bytes) {
        for (const std::uint8_t byte : bytes) {
            receive(byte);
        }
    }

    bool pended() {
        const bool is = nvic_.ISPR[1] == 1U << 6U;
        nvic_.ISPR[1] = 0;
        return is;
    }

    /// Calls the interrupt handler until the port has no pending interrupt.
    Bytes transmit() {
        Bytes sent;
        for (int i = 0; i < 5000; ++i) {
            constexpr std::uint32_t kNothing = 0xFFFF'FFFF;
            registers_.TDR = kNothing;
            registers_.ISR = kReady | ISR_TXFNF;
            port_.on_interrupt();
            if (registers_.TDR != kNothing) {
                sent.push_back(static_cast<std::uint8_t>(registers_.TDR));
            }
            if ((registers_.CR1 & CR1_TXFNFIE) == 0) {
                break;
            }
        }
        return sent;
    }

    UsartRegisters registers_{};
    NvicRegisters nvic_{};
    test::SteppingClock clock_;
    UsartPort port_{registers_, {nvic_, kUsart2Interrupt}, clock_};
};

TEST_F(Usart, DividesItsClockToTheNearestBaudRate) {
    EXPECT_EQ(baud_divider(170'000'000, 115'200), 1476U);
    EXPECT_EQ(baud_divider(170'000'000, 921'600), 184U);
    EXPECT_EQ(baud_divider(16'000'000, 1'000'000), 16U);
    EXPECT_EQ(baud_divider(16'000'000, 1'100'000), 0U) << "fewer than 16 samples per bit";
    EXPECT_EQ(baud_divider(170'000'000, 1200), 0U) << "more than 16 bits";
    EXPECT_EQ(baud_divider(170'000'000, 0), 0U);
}

TEST_F(Usart, OpensWithFifoAndReceptionOnAndTransmissionIdle) {
    open();
    EXPECT_EQ(registers_.BRR, 184U);
    EXPECT_EQ(registers_.CR1, CR1_UE | CR1_RE | CR1_TE | CR1_FIFOEN | CR1_RXFNEIE);
    EXPECT_EQ(registers_.CR3, CR3_EIE);
    port_.close();
    EXPECT_EQ(registers_.CR1, 0U);
    registers_.ISR = kReady | ISR_TXFNF;
    port_.on_interrupt();
    EXPECT_EQ(registers_.CR1, 0U) << "a late interrupt has no effect";
}

TEST_F(Usart, AnUnclockedPeripheralIsReported) {
    EXPECT_EQ(port_.open().code(), StatusCode::device_lost);
    EXPECT_NE(std::string(port_.detail()).find("is its clock on?"), std::string::npos);
    EXPECT_EQ(port_.send(Bytes{1, 2}).code(), StatusCode::device_lost);
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::device_lost);
    EXPECT_EQ(port_.wait(Microseconds{10}).code(), StatusCode::device_lost);
}

TEST_F(Usart, SendsFramedMessagesByteByByte) {
    open();
    const Bytes first{1, 0, 2, 0, 0};
    const Bytes second(200, 7);
    EXPECT_TRUE(port_.send(first).ok());
    EXPECT_TRUE(pended());
    EXPECT_TRUE(port_.send(second).ok());
    Bytes expected = test::framed(first);
    const Bytes rest = test::framed(second);
    expected.insert(expected.end(), rest.begin(), rest.end());
    EXPECT_EQ(transmit(), expected);
    EXPECT_EQ(registers_.CR1 & CR1_TXFNFIE, 0U);
    EXPECT_EQ(port_.counters().sent, 2U);
}

TEST_F(Usart, WaitsForRoomInTheTransmitter) {
    open();
    ASSERT_TRUE(port_.send(Bytes{1}).ok());
    registers_.TDR = 0xAA;
    registers_.ISR = kReady;  // full
    port_.on_interrupt();
    EXPECT_EQ(registers_.TDR, 0xAAU);
    EXPECT_NE(registers_.CR1 & CR1_TXFNFIE, 0U) << "an interrupt is requested";
}

TEST_F(Usart, RefusesTooLongAndTooManyMessages) {
    open();
    EXPECT_EQ(port_.send(Bytes(kBoardMessageBytes + 1)).code(), StatusCode::invalid_argument);
    EXPECT_EQ(port_.send(Bytes{}).code(), StatusCode::invalid_argument);
    EXPECT_TRUE(port_.send(Bytes(kBoardMessageBytes)).ok());
    EXPECT_TRUE(port_.send(Bytes(64)).ok()) << "there is still room for a pose";
    EXPECT_EQ(port_.send(Bytes(64)).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.counters().send_queue_full, 1U);
    EXPECT_EQ(transmit().size(), test::framed(Bytes(kBoardMessageBytes)).size() + test::framed(Bytes(64)).size());
    EXPECT_TRUE(port_.send(Bytes(kBoardMessageBytes)).ok());
}

TEST_F(Usart, ReceivesMessagesAndStampsThem) {
    open();
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.wait(Microseconds{50}).code(), StatusCode::timed_out);
    const Bytes sent{9, 8, 0, 7};
    receive(test::framed(sent));
    EXPECT_TRUE(port_.wait(Microseconds{50}).ok());
    clock_.advance(Microseconds{1000});
    ASSERT_TRUE(port_.receive(message).ok());
    EXPECT_EQ(Bytes(message.bytes.begin(), message.bytes.end()), sent);
    EXPECT_GE(to_us(message.arrival), 1000);
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
}

TEST_F(Usart, RecoversFromOverrunAndFramingErrors) {
    open();
    hal::ReceivedMessage message;
    const Bytes sent{1, 2, 3};
    const Bytes stream = test::framed(sent);
    for (const std::uint32_t error : {ISR_ORE, ISR_FE}) {
        registers_.ICR = 0;
        for (std::size_t i = 0; i < stream.size(); ++i) {
            receive(stream[i], i == 2 ? error : 0);
            if (i == 2) {
                EXPECT_EQ(registers_.ICR, error) << "ICR and ISR have the error at the same bit";
            }
        }
        const bool byte_was_kept = error == ISR_ORE;
        EXPECT_EQ(port_.receive(message).ok(), byte_was_kept);
        receive(stream);
        EXPECT_TRUE(port_.receive(message).ok());
    }
    EXPECT_EQ(port_.counters().receive_dropped, 1U);
    EXPECT_EQ(port_.counters().link_faults, 1U);
    EXPECT_EQ(port_.wire_errors().total(), 1U);
}

TEST_F(Usart, AnOverrunWithoutAByteIsClearedToo) {
    open();
    registers_.ISR = kReady | ISR_ORE;
    registers_.ICR = 0;
    port_.on_interrupt();
    EXPECT_EQ(registers_.ICR, ISR_ORE);
}

TEST_F(Usart, AFullRingDropsAndCountsAndRecovers) {
    open();
    receive(Bytes(256 + 20, 1));
    hal::ReceivedMessage message;
    EXPECT_EQ(port_.receive(message).code(), StatusCode::not_ready);
    EXPECT_EQ(port_.counters().receive_dropped, 20U);
    receive({0});
    EXPECT_FALSE(port_.receive(message).ok());
    EXPECT_EQ(port_.wire_errors().total(), 1U);
    receive(test::framed({5}));
    EXPECT_TRUE(port_.receive(message).ok());
}

TEST_F(Usart, SurvivesRandomBytesAndErrors) {
    open();
    std::mt19937 random(7);
    hal::ReceivedMessage message;
    for (int i = 0; i < 100'000; ++i) {
        const std::uint32_t errors = random() % 20 == 0 ? random() & (ISR_FE | ISR_NE | ISR_ORE) : 0U;
        receive(static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random()), errors);
        if (random() % 100 == 0) {
            while (port_.receive(message).ok()) {
                ASSERT_LE(message.bytes.size(), kBoardMessageBytes + 4);
            }
        }
    }
    while (port_.wait(Microseconds{1}).ok()) {
        (void)port_.receive(message);
    }
    receive({0});
    receive(test::framed({1, 2, 3}));
    EXPECT_TRUE(port_.receive(message).ok());
}

}  // namespace
}  // namespace tricoil::stm32g4
