// A firmware image in parts: order, permission, trial and confirmation, without hardware.
#include <gtest/gtest.h>

#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::DeviceBench;

constexpr std::size_t kPart = protocol::kImagePartBytes;

struct Update : ::testing::Test {
    Update() {
        board.run(0.05);
        board.host().hello();
        board.run(0.01);
        image[0] = static_cast<std::uint8_t>(image.size());
        image[1] = static_cast<std::uint8_t>(image.size() >> 8U);
    }
    AckResult write(std::size_t part, std::size_t link = 0) {
        board.host(link).write_image(static_cast<std::uint32_t>(kPart * part), std::span(image).subspan(kPart * part, kPart));
        board.run(0.02);
        return board.host(link).result().value_or(AckResult::unreadable);
    }
    AckResult start() { return *board.ask(Opcode::loader, protocol::kImageKey); }
    [[nodiscard]] std::uint32_t stored() { return board.host().acks.back().argument; }

    DeviceBench board;
    std::vector<std::uint8_t> image = std::vector<std::uint8_t>(3 * kPart, 7);
};

TEST_F(Update, NeedsThePermissionOnce) {
    EXPECT_EQ(write(0), AckResult::refused);
    board.press_button();
    for (const std::size_t part : {0U, 1U, 2U}) {
        EXPECT_EQ(start(), AckResult::wrong_state) << "not complete";
        EXPECT_EQ(write(part), AckResult::done);
        EXPECT_EQ(stored(), kPart * (part + 1));
    }
    EXPECT_EQ(board.image.image, image);
    EXPECT_EQ(write(0), AckResult::refused) << "the permission is used";
    EXPECT_EQ(start(), AckResult::done);
    board.run(0.1);
    EXPECT_EQ(board.image.trials, 1);
    EXPECT_EQ(board.system.loader_restarts(), 0);
}

TEST_F(Update, AcceptsARepeatedPartAndNoGap) {
    board.press_button();
    EXPECT_EQ(write(0), AckResult::done);
    EXPECT_EQ(write(2), AckResult::bad_value);
    board.host().repeat();
    board.run(0.01);
    EXPECT_EQ(board.image.image.size(), kPart);
    EXPECT_EQ(write(1), AckResult::done);
    board.host().repeat();  // after a lost acknowledgement
    board.run(0.01);
    EXPECT_EQ(board.host().result(), AckResult::done);
    EXPECT_EQ(stored(), 2 * kPart);
    EXPECT_EQ(board.image.image.size(), 2 * kPart);
}

TEST_F(Update, IsRefusedWhileMeasuringAndForOtherBoards) {
    board.press_button();
    EXPECT_EQ(board.ask(Opcode::start), AckResult::done);
    EXPECT_EQ(write(0), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done);
    image[0] = 0;
    EXPECT_EQ(write(0), AckResult::bad_value);
    image[0] = 1;
    board.image.is_worn_out = true;
    EXPECT_EQ(write(0), AckResult::failed);
    EXPECT_EQ(write(0, 1), AckResult::wrong_state) << "no hello on this link";
}

TEST_F(Update, IsConfirmedByAHostAndEndsWithoutOne) {
    board.image.on_trial = true;
    board.boot();
    board.run(1);
    EXPECT_EQ(board.image.confirmations, 0);
    board.run(30);
    EXPECT_GT(board.image.returns, 0);
    board.host().hello();
    board.run(0.01);
    EXPECT_EQ(board.image.confirmations, 1);
    board.host().hello();
    board.run(0.01);
    EXPECT_EQ(board.image.confirmations, 1);
}

/// Such an image must not replace the one that works.
TEST_F(Update, IsNotConfirmedIfTheSelfCheckFails) {
    board.image.on_trial = true;
    board.system.set_faults(hal::SystemFaults{hal::SystemFault::memory});
    board.boot();
    board.run(0.05);
    board.host().hello();
    board.run(30);
    EXPECT_EQ(board.image.confirmations, 0);
    EXPECT_GT(board.image.returns, 0);
}

/// A board that starts without a host does so after the confirmation only.
TEST_F(Update, DrivesNoCoilOnTrial) {
    EXPECT_EQ(board.ask(static_cast<Opcode>(static_cast<std::size_t>(Opcode::set_parameter) + protocol::kStart), 1),
              AckResult::done);
    board.press_button();
    EXPECT_EQ(board.ask(Opcode::save_parameters), AckResult::done);
    board.image.on_trial = true;
    board.boot();
    board.run(0.1);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::idle);
    board.host().hello();
    board.run(0.1);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::running);
}

}  // namespace
}  // namespace tricoil
