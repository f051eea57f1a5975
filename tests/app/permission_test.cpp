// Commands that replace firmware or calibration need a press of the button, each its own.
#include <gtest/gtest.h>

#include "core/calibration/blob.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::DeviceBench;

calibration::Blob blob_of(double gain) {
    calibration::Calibration<double> c;
    c.model.source_moment = gain * Mat3<double>::Identity();
    return calibration::encode(c);
}

struct Permission : ::testing::Test {
    Permission() {
        board.run(0.05);
        board.host().hello();
        board.run(0.01);
    }
    AckResult write(double gain, std::size_t link = 0) {
        board.host(link).write(blob_of(gain));
        board.run(0.02);
        return board.host(link).result().value_or(AckResult::unreadable);
    }
    [[nodiscard]] std::uint32_t reason() { return board.host().acks.back().argument; }
    int remaining_s() {
        board.ask(Opcode::read_condition);
        return board.host().conditions.back().permission_s;
    }

    DeviceBench board;
};

TEST_F(Permission, IsNeededForLoaderAndCalibration) {
    EXPECT_EQ(write(1), AckResult::refused);
    EXPECT_EQ(reason(), static_cast<std::uint32_t>(protocol::Refusal::no_permission));
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::refused);
    EXPECT_EQ(reason(), static_cast<std::uint32_t>(protocol::Refusal::no_permission));
    board.run(0.2);
    EXPECT_EQ(board.storage.operations(), 0U);
    EXPECT_EQ(board.system.loader_restarts(), 0);
    EXPECT_EQ(board.ask(Opcode::excite), AckResult::refused);
    EXPECT_EQ(reason(), static_cast<std::uint32_t>(protocol::Refusal::unsupported)) << "the button does not help here";
}

TEST_F(Permission, OfOnePressIsForOneCommand) {
    board.press_button();
    EXPECT_EQ(remaining_s(), 60);
    EXPECT_EQ(write(1), AckResult::done);
    EXPECT_EQ(remaining_s(), 0);
    EXPECT_EQ(write(1), AckResult::done) << "a host repeats a message after a lost acknowledgement";
    EXPECT_EQ(write(2), AckResult::refused);
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::refused);
    board.press_button();
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::done);
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::done) << "repeated";
    board.run(0.1);
    EXPECT_EQ(board.system.loader_restarts(), 1);
}

/// A program that is started again counts its calibrations from zero.
TEST_F(Permission, IsForTheNextProgramToo) {
    EXPECT_EQ(write(1), AckResult::refused);
    board.press_button();
    board.host().hello();
    board.run(0.01);
    board.host().say_again();
    board.host().say_again();  // the number of the refused calibration
    EXPECT_EQ(write(1), AckResult::done);
}

TEST_F(Permission, IsNotUsedByARefusedCommand) {
    board.press_button();
    board.host().write(std::vector<std::uint8_t>(100));
    board.run(0.02);
    EXPECT_EQ(board.host().result(), AckResult::bad_value);
    EXPECT_EQ(board.ask(Opcode::loader, 1), AckResult::bad_value);
    EXPECT_EQ(write(1), AckResult::done);
}

TEST_F(Permission, EndsAfterAMinute) {
    board.press_button();
    board.run(58);
    EXPECT_EQ(write(1), AckResult::done);
    board.press_button();
    board.run(60);
    EXPECT_EQ(remaining_s(), 0);
    EXPECT_EQ(write(2), AckResult::refused);
}

TEST_F(Permission, IsNotGivenByAButtonThatIsStuckOrNoisy) {
    board.button.press(true);
    board.boot();
    board.run(0.3);
    board.host().hello();
    board.run(0.02);
    EXPECT_EQ(write(1), AckResult::refused) << "closed since power-on";
    board.button.press(false);
    board.run(0.1);
    for (int n = 0; n < 20; ++n) {  // short pulses
        board.button.press(true);
        board.run(0.005);
        board.button.press(false);
        board.run(0.005);
    }
    EXPECT_EQ(write(1), AckResult::refused);
    board.press_button();
    EXPECT_EQ(write(1), AckResult::done);
    board.button.press(true);
    board.run(130);
    EXPECT_EQ(remaining_s(), 0) << "a held button is one press";
}

/// A node on the bus that nobody knows cannot write before a press, with or without hello.
TEST_F(Permission, IsNeededOnEveryLink) {
    EXPECT_EQ(write(1, 1), AckResult::wrong_state) << "without hello";
    for (std::size_t n = 0; n < DeviceBench::kLinks; ++n) {
        board.host(n).hello();
        board.run(0.02);
        EXPECT_EQ(write(1, n), AckResult::refused) << n;
    }
    EXPECT_EQ(board.storage.operations(), 0U);
}

}  // namespace
}  // namespace tricoil
