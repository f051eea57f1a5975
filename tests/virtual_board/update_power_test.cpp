// Power is lost in every flash operation of an update; a trial without a host or without power.
#include <gtest/gtest.h>

#include "tests/virtual_board/updated_board.hpp"

namespace tricoil {
namespace {

using namespace test;

TEST(UpdatePower, LostInEveryOperationLeavesTheOldImage) { lose_power_while_writing(1); }

TEST(UpdateTrial, WithoutAHostEndsWithTheOldImage) {
    UpdatedBoard board;
    board.update(new_image());
    board.run(29);
    EXPECT_TRUE(board.board->runs_bank_2());
    board.run(2);
    EXPECT_FALSE(board.board->runs_bank_2());
    board.boot();
    EXPECT_EQ(board.running(), word_at(the_image(), kCrc));
}

/// The confirmation is one double-word. Both images are sound then.
TEST(UpdatePower, LostDuringTheTrialOrItsConfirmationLeavesASoundImage) {
    UpdatedBoard board;
    board.update(new_image());
    board.run(BoardBench::kBootS);
    EXPECT_TRUE(board.board->runs_bank_2()) << "on trial";
    board.board->power_cycle();
    board.boot();
    EXPECT_EQ(board.running(), word_at(the_image(), kCrc));
    board.update(new_image());
    board.run(BoardBench::kBootS);
    board.board->lose_power_in_flash_operation(0);
    board.boot();  // its hello confirms
    board.boot();
    EXPECT_NE(board.running(), 0U);
    board.update(new_image());
    board.boot();
    board.board->power_cycle();
    board.boot();
    EXPECT_EQ(board.running(), word_at(new_image(), kCrc)) << "after the damaged entry";
}

}  // namespace
}  // namespace tricoil
