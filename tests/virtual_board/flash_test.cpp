// Flash memory of the virtual board: fast rows, keys of the option bytes, flags.
#include "sim/virtual_board/peripherals/flash.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

struct FlashTest : PeripheralsTest {
    void unlock() {
        flash.write(0x00, 0x00040200);  // data cache off
        flash.write(0x08, 0x45670123);
        flash.write(0x08, 0xCDEF89AB);
    }
    Flash flash{machine};
};

TEST_F(FlashTest, RowsAreProgrammedFast) {
    unlock();
    const auto write_row = [this] {
        for (std::uint32_t at = 0; at < 256; at += 4) {
            EXPECT_EQ(flash.read(0x10), 0U);
            flash.other_bank().write(at, at);
        }
    };
    flash.write(0x14, 1U << 18U);
    write_row();
    EXPECT_EQ(flash.read(0x10), 1U << 7U) << "PGSERR: no mass erase before";
    flash.write(0x10, 1U << 7U);
    flash.write(0x14, 1U << 15U);
    flash.write(0x14, 1U << 15U | 1U << 16U);
    pass(30e-3);
    flash.write(0x14, 1U << 18U);
    flash.other_bank().write(4, 0);
    EXPECT_EQ(flash.read(0x10), 1U << 5U) << "PGAERR: not the begin of a row";
    flash.write(0x10, 1U << 5U);
    write_row();
    EXPECT_EQ(flash.read(0x10), 1U << 16U) << "BSY";
    pass(2e-3);
    EXPECT_EQ(flash.read(0x10), 0U);
    EXPECT_EQ(flash.other_bank().read(252), 252U);
    EXPECT_EQ(flash.other_bank().read(256), 0xFFFFFFFFU);
}

TEST_F(FlashTest, OptionBytesHaveTheirOwnKeys) {
    EXPECT_THROW(flash.write(0x0C, 0x08192A3B), RunFailure) << "the flash is locked";
    unlock();
    flash.write(0x0C, 0x08192A3B);
    flash.write(0x0C, 0x4C5D6E7F);
    EXPECT_EQ(flash.read(0x14), 0U);
    EXPECT_THROW(flash.write(0x0C, 0x08192A3B), RunFailure) << "not locked";
    EXPECT_THROW(flash.write(0x2C, 0), RunFailure) << "changes of option bytes are not in this model";
}

TEST_F(FlashTest, EndOfOperationNeedsItsInterruptEnable) {
    unlock();
    flash.write(0x14, 1U << 15U);
    EXPECT_EQ(flash.read(0x14) >> 30U, 1U) << "writing 0 does not clear OPTLOCK";
    flash.write(0x14, 1U << 15U | 1U << 16U);
    pass(30e-3);
    EXPECT_EQ(flash.read(0x10), 0U) << "no PGSERR after the erase of the bank, no EOP without EOPIE";
    EXPECT_FALSE(is_pending(4));
    flash.write(0x14, 1U << 24U | 1U << 15U | 1U << 16U);
    pass(30e-3);
    EXPECT_EQ(flash.read(0x10), 1U);
    EXPECT_TRUE(is_pending(4));
}

}  // namespace
}  // namespace tricoil::virtual_board
