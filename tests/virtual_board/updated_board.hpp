// A board whose image is updated over a link, and images for it.
#pragma once

#include <cstring>

#include "core/base/crc32.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil::test {

using protocol::AckResult;
using protocol::Opcode;

using Image = std::vector<std::uint8_t>;  // from the vectors on

// Offsets from the vectors on (board/stm32g4/flash_layout.hpp, image_header.hpp).
constexpr std::size_t kProgram = 0x2000;
constexpr std::size_t kHeader = 0x200;
constexpr std::size_t kEnd = kHeader + 12;
constexpr std::size_t kCommit = kHeader + 16;
constexpr std::size_t kBoard = kHeader + 32;
constexpr std::size_t kCrc = kHeader + 48;
constexpr std::size_t kBootRecord = kHeader + 52;

inline void put(Image& image, std::size_t at, std::uint32_t word) { std::memcpy(image.data() + at, &word, sizeof word); }
inline std::uint32_t word_at(const Image& image, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, image.data() + at, sizeof word);
    return word;
}
inline Image sealed(Image image) {
    put(image, kCrc, 0);
    put(image, kCrc, crc32(image));
    return image;
}

inline Image the_image() {
    const auto file = read_image(TRICOIL_BOARD_IMAGE ".bin");
    return {file.begin() + kProgram, file.end()};
}
/// The same program with another commit in its header.
inline Image new_image(char letter = 'n') {
    Image image = the_image();
    image[kCommit] = static_cast<std::uint8_t>(letter);
    return sealed(image);
}
/// A program that hangs at its first instruction: `b .`, in place of the reset handler.
inline Image hanging(Image image) {
    const std::size_t start = (word_at(image, 4) & ~1U) - virtual_board::Memory::kFlashBase - kProgram;
    put(image, start, 0xE7FEE7FE);
    return sealed(image);
}
/// Header and nothing else, to write it quickly: hangs as well.
inline Image short_image() {
    Image image = the_image();
    image.resize(kHeader + 200);
    put(image, kEnd, static_cast<std::uint32_t>(virtual_board::Memory::kFlashBase + kProgram + image.size()));
    put(image, 4, static_cast<std::uint32_t>(virtual_board::Memory::kFlashBase + kProgram + kHeader + 100 + 1));
    return hanging(image);
}

class UpdatedBoard : public BoardBench {
public:
    explicit UpdatedBoard(std::size_t by = on_serial) : link(by) { boot(); }

    void boot() {
        run(kBootS);
        host(link).hello();
        run(0.03);
    }
    /// CRC of the running image, which must be sound.
    std::uint32_t running() {
        const std::size_t before = host(link).conditions.size();
        host(link).command(Opcode::read_condition);
        for (int n = 0; n < 100 && host(link).conditions.size() == before; ++n) {
            run(0.005);
        }
        if (host(link).conditions.size() == before) {
            ADD_FAILURE() << "no answer";
            return 0;
        }
        EXPECT_EQ(host(link).conditions.back().image, 1) << "sound";
        return host(link).conditions.back().image_crc;
    }
    /// Result of one part; empty without an answer.
    std::optional<AckResult> part(const Image& image, std::size_t at) {
        host(link).write_image(static_cast<std::uint32_t>(at),
                               std::span(image).subspan(at, std::min(protocol::kImagePartBytes, image.size() - at)));
        for (int n = 0; n < 200 && !host(link).result(); ++n) {
            run(0.002);
        }
        return host(link).result();
    }
    /// Result of the last part, or of the first one that is not stored.
    std::optional<AckResult> write(const Image& image) {
        for (std::size_t at = 0; at < image.size(); at += protocol::kImagePartBytes) {
            const auto result = part(image, at);
            if (result != AckResult::done || at + protocol::kImagePartBytes >= image.size()) {
                return result;
            }
        }
        return {};
    }
    std::optional<AckResult> start_image() { return ask(link, Opcode::loader, protocol::kImageKey); }
    void update(const Image& image) {
        press_button();
        ASSERT_EQ(write(image), AckResult::done);
        ASSERT_EQ(start_image(), AckResult::done);
        run(0.1);
    }

    std::size_t link;
};

/// Loses power in each `every`-th flash operation of the writing of an image.
inline void lose_power_while_writing(std::uint64_t every) {
    UpdatedBoard board;
    const std::uint64_t before = board.board->flash.operations();
    board.press_button();
    ASSERT_EQ(board.write(short_image()), AckResult::done);
    const std::uint64_t operations = board.board->flash.operations() - before;
    for (std::uint64_t n = 0; n < operations; n += every) {
        board.press_button();
        board.board->lose_power_in_flash_operation(n);
        for (std::size_t at = 0; at < short_image().size() && board.part(short_image(), at); at += protocol::kImagePartBytes) {
        }
        EXPECT_FALSE(board.board->runs_bank_2());
        board.boot();
        EXPECT_EQ(board.running(), word_at(the_image(), kCrc)) << "operation " << n;
    }
    std::printf("power lost in each %lu. of %lu operations\n", every, operations);
    board.update(new_image());
    board.boot();
    EXPECT_EQ(board.running(), word_at(new_image(), kCrc)) << "and then it can be updated";
}

}  // namespace tricoil::test
