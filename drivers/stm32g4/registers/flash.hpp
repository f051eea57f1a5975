// Flash memory interface (RM0440, chapter FLASH), two banks of 128 pages of 2 KiB.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct FlashRegisters {
    volatile std::uint32_t ACR;
    volatile std::uint32_t PDKEYR;
    volatile std::uint32_t KEYR;
    volatile std::uint32_t OPTKEYR;
    volatile std::uint32_t SR;
    volatile std::uint32_t CR;
    volatile std::uint32_t ECCR;
    std::uint32_t reserved;
    volatile std::uint32_t OPTR;
};
static_assert(offsetof(FlashRegisters, SR) == 0x10);
static_assert(offsetof(FlashRegisters, OPTR) == 0x20);

constexpr std::uintptr_t kFlashBase = 0x4002'2000;   // of the registers
constexpr std::uintptr_t kFlash = 0x0800'0000;       // of the bank that runs
constexpr std::size_t kFlashBankBytes = 256 * 1024;  // the other bank follows
constexpr std::size_t kFlashPageBytes = 2048;

namespace flash {
constexpr std::uint32_t ACR_LATENCY = 15U;
constexpr std::uint32_t ACR_PRFTEN = 1U << 8U;
constexpr std::uint32_t ACR_ICEN = 1U << 9U;
constexpr std::uint32_t ACR_DCEN = 1U << 10U;
constexpr std::uint32_t ACR_ICRST = 1U << 11U;
constexpr std::uint32_t ACR_DCRST = 1U << 12U;

constexpr std::uint32_t KEYR_KEY1 = 0x4567'0123;
constexpr std::uint32_t KEYR_KEY2 = 0xCDEF'89AB;

constexpr std::uint32_t SR_ERRORS = 0xC3FAU;  // OPERR, PROGERR, WRPERR, PGAERR, SIZERR, PGSERR, MISERR, FASTERR, RDERR, OPTVERR
constexpr std::uint32_t SR_BSY = 1U << 16U;

constexpr std::uint32_t CR_PG = 1U << 0U;
constexpr std::uint32_t CR_PER = 1U << 1U;
constexpr unsigned CR_PNB_Pos = 3;
constexpr std::uint32_t CR_BKER = 1U << 11U;
constexpr std::uint32_t CR_STRT = 1U << 16U;
constexpr std::uint32_t CR_LOCK = 1U << 31U;

constexpr std::uint32_t ECCR_BK_ECC = 1U << 21U;
constexpr std::uint32_t ECCR_ECCD = 1U << 31U;  // uncorrectable error in a double-word; raises the NMI; write 1 to clear

constexpr std::uint32_t OPTR_RDP = 255U;  // read protection; every other value: level 1
constexpr std::uint32_t OPTR_RDP_0 = 0xAAU;
constexpr std::uint32_t OPTR_RDP_2 = 0xCCU;
constexpr std::uint32_t OPTR_BOR_LEV = 7U << 8U;
constexpr std::uint32_t OPTR_BOR_LEV_2V8 = 4U << 8U;
constexpr std::uint32_t OPTR_BFB2 = 1U << 20U;  // boots from bank 2 if it has a program
constexpr std::uint32_t OPTR_DBANK = 1U << 22U;
constexpr std::uint32_t OPTR_nSWBOOT0 = 1U << 26U;  // 1: the pin PB8 is BOOT0
constexpr std::uint32_t OPTR_nBOOT0 = 1U << 27U;
}  // namespace flash

}  // namespace tricoil::stm32g4
