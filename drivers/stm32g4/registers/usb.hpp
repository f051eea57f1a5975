// Universal serial bus full-speed device, its packet memory (RM0440, chapter USB), and the clock recovery system (chapter CRS).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

/// A 16-bit register; the registers are four bytes apart.
struct UsbEndpointRegister {
    volatile std::uint16_t R;
    std::uint16_t reserved;
};

struct UsbRegisters {
    UsbEndpointRegister EP[8];
    std::uint32_t reserved_0[8];
    volatile std::uint16_t CNTR;
    std::uint16_t reserved_1;
    volatile std::uint16_t ISTR;
    std::uint16_t reserved_2[3];
    volatile std::uint16_t DADDR;
    std::uint16_t reserved_4;
    volatile std::uint16_t BTABLE;
    std::uint16_t reserved_5[3];
    volatile std::uint16_t BCDR;
};
static_assert(offsetof(UsbRegisters, CNTR) == 0x40);
static_assert(offsetof(UsbRegisters, DADDR) == 0x4C);
static_assert(offsetof(UsbRegisters, BCDR) == 0x58);

/// One entry of the buffer table: byte addresses in the packet memory, and counts.
struct UsbBufferEntry {
    volatile std::uint16_t ADDR_TX;
    volatile std::uint16_t COUNT_TX;
    volatile std::uint16_t ADDR_RX;
    volatile std::uint16_t COUNT_RX;
};

/// 1 KiB, half-word access only; the buffer table is at its beginning.
union UsbPacketMemory {
    UsbBufferEntry entries[8];
    volatile std::uint16_t half_words[512];
};
static_assert(sizeof(UsbPacketMemory) == 1024);

struct CrsRegisters {
    volatile std::uint32_t CR;
    volatile std::uint32_t CFGR;
    volatile std::uint32_t ISR;
    volatile std::uint32_t ICR;
};

constexpr std::uintptr_t kUsbBase = 0x4000'5C00;
constexpr std::uintptr_t kUsbPacketMemoryBase = 0x4000'6000;
constexpr std::uintptr_t kCrsBase = 0x4000'2000;
constexpr std::uint8_t kUsbLowPriorityInterrupt = 20;

namespace usb {
// EPnR. DTOG and STAT: writing 1 toggles, 0 keeps. CTR: writing 0 clears, 1 keeps.
constexpr std::uint16_t EP_CTR_RX = 0x8000;
constexpr std::uint16_t EP_DTOG_RX = 0x4000;
constexpr std::uint16_t EP_STAT_RX = 0x3000;
constexpr unsigned EP_STAT_RX_Pos = 12;
constexpr std::uint16_t EP_SETUP = 0x0800;
constexpr std::uint16_t EP_TYPE = 0x0600;
constexpr std::uint16_t EP_TYPE_bulk = 0x0000;
constexpr std::uint16_t EP_TYPE_control = 0x0200;
constexpr std::uint16_t EP_KIND = 0x0100;
constexpr std::uint16_t EP_CTR_TX = 0x0080;
constexpr std::uint16_t EP_DTOG_TX = 0x0040;
constexpr std::uint16_t EP_STAT_TX = 0x0030;
constexpr unsigned EP_STAT_TX_Pos = 4;
constexpr std::uint16_t EP_EA = 0x000F;
// CNTR
constexpr std::uint16_t CNTR_CTRM = 0x8000;
constexpr std::uint16_t CNTR_PMAOVRM = 0x4000;
constexpr std::uint16_t CNTR_WKUPM = 0x1000;
constexpr std::uint16_t CNTR_SUSPM = 0x0800;
constexpr std::uint16_t CNTR_RESETM = 0x0400;
constexpr std::uint16_t CNTR_FSUSP = 0x0008;
constexpr std::uint16_t CNTR_PDWN = 0x0002;
constexpr std::uint16_t CNTR_FRES = 0x0001;
// ISTR: writing 0 clears a flag, 1 keeps it.
constexpr std::uint16_t ISTR_CTR = 0x8000;
constexpr std::uint16_t ISTR_PMAOVR = 0x4000;
constexpr std::uint16_t ISTR_WKUP = 0x1000;
constexpr std::uint16_t ISTR_SUSP = 0x0800;
constexpr std::uint16_t ISTR_RESET = 0x0400;
constexpr std::uint16_t DADDR_EF = 0x0080;
constexpr std::uint16_t BCDR_DPPU = 0x8000;
// COUNT_RX
constexpr std::uint16_t COUNT_RX_64_bytes = 0x8400;  // BL_SIZE: blocks of 32 bytes; NUM_BLOCK: two blocks
constexpr std::uint16_t COUNT_RX_COUNT = 0x03FF;
}  // namespace usb

namespace crs {
constexpr std::uint32_t CR_CEN = 1U << 5U;
constexpr std::uint32_t CR_AUTOTRIMEN = 1U << 6U;
constexpr std::uint32_t CFGR_SYNCSRC = 3U << 28U;
constexpr std::uint32_t CFGR_SYNCSRC_usb = 2U << 28U;
}  // namespace crs

}  // namespace tricoil::stm32g4
