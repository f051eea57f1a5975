// Update of the flash image over a link: the new image is tried once and confirmed by its first host; after every failure, and
// with power lost in a flash operation, the board runs a sound image.
#include <gtest/gtest.h>

#include "tests/virtual_board/updated_board.hpp"

namespace tricoil {
namespace {

using namespace test;

class Update : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Update, RunsTheNewImageAndKeepsIt) {
    UpdatedBoard board(GetParam());
    const double begin_s = board.board->now_s();
    board.update(new_image());
    std::printf("%.1f s on link %zu\n", board.board->now_s() - begin_s, GetParam());
    EXPECT_TRUE(board.board->runs_bank_2());
    board.boot();
    EXPECT_EQ(board.running(), word_at(new_image(), kCrc));
    EXPECT_EQ(board.ask(GetParam(), Opcode::start), AckResult::done) << "and it measures";
    board.board->power_cycle();
    board.boot();
    EXPECT_EQ(board.running(), word_at(new_image(), kCrc)) << "without power";
}
INSTANTIATE_TEST_SUITE_P(Links, Update, ::testing::Values(test::on_serial, test::on_can, test::on_usb));

TEST(UpdateRefusal, NeedsTheButton) {
    UpdatedBoard board;
    const std::uint64_t operations = board.board->flash.operations();
    EXPECT_EQ(board.part(new_image(), 0), AckResult::refused);
    EXPECT_EQ(board.host().acks.back().argument, static_cast<std::uint32_t>(protocol::Refusal::no_permission));
    EXPECT_EQ(board.start_image(), AckResult::wrong_state) << "no image was written";
    EXPECT_EQ(board.board->flash.operations(), operations);
    board.press_button();
    EXPECT_EQ(board.part(new_image(), 0), AckResult::done);
    EXPECT_EQ(board.part(new_image(), 0), AckResult::refused) << "one press is for one image";
}

TEST(UpdateRefusal, OfImagesForOtherBoards) {
    UpdatedBoard board;
    board.press_button();
    const std::uint64_t operations = board.board->flash.operations();
    for (const auto& [at, word] :
         {std::pair{kHeader, 0x12345678U}, std::pair{kHeader + 4, 0x03030002U}, std::pair{kEnd, 0x0803E004U},
          std::pair{kEnd, 0x08002100U}, std::pair{kBoard + 8, 0x37346765U}, std::pair{kBootRecord, 0x20001900U},
          std::pair{std::size_t{0}, 0x10000000U}, std::pair{std::size_t{4}, 0x08042001U}}) {
        Image image = new_image();
        put(image, at, word);
        EXPECT_EQ(board.part(sealed(image), 0), AckResult::bad_value) << at;
    }
    EXPECT_EQ(board.part(new_image(), protocol::kImagePartBytes), AckResult::bad_value) << "not the first part";
    EXPECT_EQ(board.board->flash.operations(), operations) << "nothing was changed";
    EXPECT_EQ(board.part(new_image(), 0), AckResult::done) << "and the permission is still there";
}

TEST(UpdateRefusal, OfADamagedImage) {
    UpdatedBoard board;
    board.press_button();
    Image image = short_image();
    image[kHeader + 60] ^= 1;
    EXPECT_EQ(board.write(image), AckResult::failed);
    EXPECT_EQ(board.start_image(), AckResult::wrong_state);
    board.press_button();
    EXPECT_EQ(board.write(short_image()), AckResult::done);
}

TEST(UpdateTrial, OfAnImageThatHangsEndsWithTheOldOne) {
    UpdatedBoard board;
    board.update(short_image());
    EXPECT_TRUE(board.board->runs_bank_2()) << "on trial";
    board.run(0.6);
    EXPECT_FALSE(board.board->runs_bank_2());
    board.boot();
    EXPECT_EQ(board.running(), word_at(the_image(), kCrc));
}

/// The settings are in bank 2: they are there, and can be written, in whichever bank the program runs.
TEST(Updates, ReturnToTheFirstBankAndKeepTheSettings) {
    UpdatedBoard board;
    const auto name = static_cast<Opcode>(static_cast<unsigned>(Opcode::set_parameter) + 7);
    const auto save = [&](std::uint32_t text) {
        EXPECT_EQ(board.ask(board.link, name, text), AckResult::done);
        board.press_button();
        EXPECT_EQ(board.ask(board.link, Opcode::save_parameters), AckResult::done);
    };
    const auto read = [&] {
        EXPECT_EQ(board.ask(board.link, Opcode::read_parameters), std::nullopt);
        return board.host().parameters.back().values[7];
    };
    save(0x41414141);
    board.update(new_image());
    board.boot();
    EXPECT_EQ(read(), 0x41414141U);
    save(0x42424242);
    board.board->power_cycle();
    board.boot();
    EXPECT_TRUE(board.board->runs_bank_2());
    EXPECT_EQ(read(), 0x42424242U);
    board.update(new_image('o'));
    EXPECT_FALSE(board.board->runs_bank_2());
    board.boot();
    board.board->power_cycle();
    board.boot();
    EXPECT_EQ(board.running(), word_at(new_image('o'), kCrc));
    EXPECT_EQ(read(), 0x42424242U);
}

TEST(UpdatePower, LostWhileWritingLeavesTheOldImage) { lose_power_while_writing(13); }

}  // namespace
}  // namespace tricoil
