// Flash pages with plain memory: register accesses and error handling.
#include "drivers/stm32g4/flash_storage.hpp"

#include <gtest/gtest.h>

#include <array>

namespace tricoil::stm32g4 {
namespace {

struct FlashStorageTest : testing::Test {
    FlashStorageTest() {
        registers.OPTR = flash::OPTR_DBANK;
        for (volatile std::uint64_t& word : memory) {
            word = ~std::uint64_t{0};
        }
    }

    FlashRegisters registers{};
    std::array<volatile std::uint64_t, 2 * kFlashPageBytes / 8> memory;
    FlashStorage storage{registers, {memory.data(), 126, 2}};
};

TEST_F(FlashStorageTest, ErasesAPageOfTheSecondBank) {
    EXPECT_EQ(storage.slots(), 2U);
    EXPECT_EQ(storage.slot_bytes(), 2048U);
    EXPECT_TRUE(storage.erase(1).ok());
    EXPECT_EQ(registers.CR, flash::CR_LOCK);  // no other bit
    EXPECT_EQ(storage.erase(2).code(), StatusCode::invalid_argument);
}

TEST_F(FlashStorageTest, ProgramsADoubleWordAndReadsItBack) {
    EXPECT_TRUE(storage.program(1, 16, 0x0123'4567'89AB'CDEF).ok());
    EXPECT_EQ(memory[256 + 2], 0x0123'4567'89AB'CDEFU);
    std::array<std::uint8_t, 16> bytes{};
    EXPECT_TRUE(storage.read(1, 16, bytes).ok());
    EXPECT_EQ(bytes[0], 0xEF);
    EXPECT_EQ(bytes[7], 0x01);
    EXPECT_EQ(bytes[8], 0xFF);
}

TEST_F(FlashStorageTest, RefusesAddressesOutOfRange) {
    std::array<std::uint8_t, 16> bytes{};
    EXPECT_EQ(storage.program(0, 4, 0).code(), StatusCode::invalid_argument);
    EXPECT_EQ(storage.program(0, 2048, 0).code(), StatusCode::invalid_argument);
    EXPECT_EQ(storage.program(2, 0, 0).code(), StatusCode::invalid_argument);
    EXPECT_EQ(storage.read(0, 2040, bytes).code(), StatusCode::invalid_argument);
    EXPECT_EQ(storage.read(0, ~std::size_t{7}, bytes).code(), StatusCode::invalid_argument);
    EXPECT_EQ(storage.read(0, 0, std::span(bytes).first(3)).code(), StatusCode::invalid_argument);
    EXPECT_EQ(registers.CR, 0U);
}

TEST_F(FlashStorageTest, ReportsALockedAndABusyFlash) {
    registers.CR = flash::CR_LOCK;  // real hardware unlocks after the keys
    EXPECT_EQ(storage.program(0, 0, 1).code(), StatusCode::device_lost);
    EXPECT_EQ(registers.KEYR, flash::KEYR_KEY2);
    EXPECT_EQ(memory[0], ~std::uint64_t{0});
    registers.CR = 0;
    registers.SR = flash::SR_BSY;
    EXPECT_EQ(storage.erase(0).code(), StatusCode::timed_out);
}

TEST_F(FlashStorageTest, ReportsHardwareErrors) {
    registers.SR = 1U << 4U;  // a plain structure does not clear bits that are written as one
    EXPECT_EQ(storage.program(0, 0, 1).code(), StatusCode::device_lost);
    EXPECT_EQ(registers.CR, flash::CR_LOCK);
}

TEST_F(FlashStorageTest, RefusesSingleBankFlash) {
    registers.OPTR = 0;
    registers.CR = 0;
    std::array<std::uint8_t, 16> bytes{};
    EXPECT_EQ(storage.erase(0).code(), StatusCode::device_lost);
    EXPECT_EQ(storage.program(0, 0, 1).code(), StatusCode::device_lost);
    EXPECT_EQ(storage.read(0, 0, bytes).code(), StatusCode::device_lost);
    EXPECT_EQ(registers.CR, 0U);
    EXPECT_EQ(memory[0], ~std::uint64_t{0});
}

TEST_F(FlashStorageTest, SwitchesTheDataCacheOnAgainAfterAnOperation) {
    registers.ACR = flash::ACR_DCEN;
    EXPECT_TRUE(storage.erase(0).ok());
    EXPECT_EQ(registers.ACR, flash::ACR_DCEN);
    registers.CR = 0;  // plain memory does not unlock
    EXPECT_TRUE(storage.program(0, 0, 1).ok());
    EXPECT_EQ(registers.ACR, flash::ACR_DCEN);
}

/// Errors during a read are tested on the virtual board, which raises the NMI.
TEST_F(FlashStorageTest, EccErrorOutsideAReadBelongsToTheProgram) {
    registers.ECCR =
        flash::ECCR_ECCD | flash::ECCR_BK_ECC | (126U * 2048U + 8U);  // an address in a page of the storage has no effect
    EXPECT_FALSE(storage.on_ecc_error());
    EXPECT_EQ(registers.ECCR, flash::ECCR_ECCD);  // written one to clear
}

}  // namespace
}  // namespace tricoil::stm32g4
