// FDCAN controller and its message RAM (RM0440, chapter FDCAN).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct FdcanRegisters {
    std::uint32_t reserved_0[3];
    volatile std::uint32_t DBTP;
    std::uint32_t reserved_1[2];
    volatile std::uint32_t CCCR;
    volatile std::uint32_t NBTP;
    std::uint32_t reserved_2[10];
    volatile std::uint32_t TDCR;
    std::uint32_t reserved_3;
    volatile std::uint32_t IR;
    volatile std::uint32_t IE;
    volatile std::uint32_t ILS;
    volatile std::uint32_t ILE;
    std::uint32_t reserved_4[8];
    volatile std::uint32_t RXGFC;
    std::uint32_t reserved_5[3];
    volatile std::uint32_t RXF0S;
    volatile std::uint32_t RXF0A;
    std::uint32_t reserved_6[10];
    volatile std::uint32_t TXBC;
    volatile std::uint32_t TXFQS;
    std::uint32_t reserved_7;
    volatile std::uint32_t TXBAR;
    std::uint32_t reserved_8[3];
    volatile std::uint32_t TXBTIE;
};
static_assert(offsetof(FdcanRegisters, CCCR) == 0x018);
static_assert(offsetof(FdcanRegisters, IR) == 0x050);
static_assert(offsetof(FdcanRegisters, RXGFC) == 0x080);
static_assert(offsetof(FdcanRegisters, RXF0S) == 0x090);
static_assert(offsetof(FdcanRegisters, TXBC) == 0x0C0);
static_assert(offsetof(FdcanRegisters, TXBTIE) == 0x0DC);

/// A frame in the message RAM.
struct FdcanElement {
    volatile std::uint32_t R0;  // T0
    volatile std::uint32_t R1;  // T1
    volatile std::uint32_t data[16];
};

/// Message RAM of one controller; the layout is fixed. Word access only.
struct FdcanMessageRam {
    volatile std::uint32_t standard_filters[28];
    volatile std::uint32_t extended_filters[16];
    FdcanElement rx_fifo_0[3];
    FdcanElement rx_fifo_1[3];
    volatile std::uint32_t tx_events[6];
    FdcanElement tx_buffers[3];
};
static_assert(offsetof(FdcanMessageRam, extended_filters) == 0x070);
static_assert(offsetof(FdcanMessageRam, rx_fifo_0) == 0x0B0);
static_assert(offsetof(FdcanMessageRam, rx_fifo_1) == 0x188);
static_assert(offsetof(FdcanMessageRam, tx_events) == 0x260);
static_assert(offsetof(FdcanMessageRam, tx_buffers) == 0x278);
static_assert(sizeof(FdcanMessageRam) == 0x350);

constexpr std::uintptr_t kFdcan2Base = 0x4000'6800;
constexpr std::uintptr_t kFdcan2RamBase = 0x4000'A400 + sizeof(FdcanMessageRam);  // after the message RAM of FDCAN1
constexpr std::uint8_t kFdcan2Interrupt0 = 86;

namespace fdcan {
constexpr std::uint32_t CCCR_INIT = 1U << 0U;
constexpr std::uint32_t CCCR_CCE = 1U << 1U;
constexpr std::uint32_t CCCR_CSA = 1U << 3U;
constexpr std::uint32_t CCCR_FDOE = 1U << 8U;
constexpr std::uint32_t CCCR_BRSE = 1U << 9U;
// NBTP and DBTP: each field holds its value minus one.
constexpr unsigned NBTP_NTSEG2_Pos = 0;
constexpr unsigned NBTP_NTSEG1_Pos = 8;
constexpr unsigned NBTP_NBRP_Pos = 16;
constexpr unsigned NBTP_NSJW_Pos = 25;
constexpr unsigned DBTP_DSJW_Pos = 0;
constexpr unsigned DBTP_DTSEG2_Pos = 4;
constexpr unsigned DBTP_DTSEG1_Pos = 8;
constexpr unsigned DBTP_DBRP_Pos = 16;
constexpr std::uint32_t DBTP_TDC = 1U << 23U;
constexpr unsigned TDCR_TDCO_Pos = 8;
// IR and IE
constexpr std::uint32_t IR_RF0N = 1U << 0U;
constexpr std::uint32_t IR_RF0L = 1U << 2U;
constexpr std::uint32_t IR_TC = 1U << 7U;
constexpr std::uint32_t IR_EP = 1U << 17U;
constexpr std::uint32_t IR_BO = 1U << 19U;
constexpr std::uint32_t ILE_EINT0 = 1U << 0U;
// RXGFC
constexpr std::uint32_t RXGFC_RRFE = 1U << 0U;
constexpr std::uint32_t RXGFC_RRFS = 1U << 1U;
constexpr std::uint32_t RXGFC_ANFE_reject = 2U << 2U;
constexpr std::uint32_t RXGFC_ANFS_reject = 2U << 4U;
constexpr unsigned RXGFC_LSS_Pos = 16;
// RXF0S
constexpr std::uint32_t RXF0S_F0FL_Msk = 0xFU;
constexpr unsigned RXF0S_F0GI_Pos = 8;
// TXFQS
constexpr unsigned TXFQS_TFQPI_Pos = 16;
constexpr std::uint32_t TXFQS_TFQF = 1U << 21U;
// Standard filter: two identifiers, to FIFO 0.
constexpr std::uint32_t SFT_dual = 1U << 30U;
constexpr std::uint32_t SFEC_fifo_0 = 1U << 27U;
constexpr unsigned SFID1_Pos = 16;
// R0, T0
constexpr std::uint32_t R0_XTD = 1U << 30U;
constexpr std::uint32_t R0_RTR = 1U << 29U;
constexpr unsigned R0_standard_id_Pos = 18;
// R1, T1
constexpr std::uint32_t R1_FDF = 1U << 21U;
constexpr std::uint32_t R1_BRS = 1U << 20U;
constexpr unsigned R1_DLC_Pos = 16;
}  // namespace fdcan

}  // namespace tricoil::stm32g4
