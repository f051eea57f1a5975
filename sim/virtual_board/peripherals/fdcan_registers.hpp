// Register offsets and bits of the CAN FD controller, and the layout of its message memory (RM0440 section 44).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board::fdcan {

constexpr std::uint32_t kDbtp = 0x0C;
constexpr std::uint32_t kTest = 0x10;
constexpr std::uint32_t kCccr = 0x18;
constexpr std::uint32_t kNbtp = 0x1C;
constexpr std::uint32_t kEcr = 0x40;
constexpr std::uint32_t kPsr = 0x44;
constexpr std::uint32_t kTdcr = 0x48;
constexpr std::uint32_t kIr = 0x50;
constexpr std::uint32_t kIe = 0x54;
constexpr std::uint32_t kIls = 0x58;
constexpr std::uint32_t kIle = 0x5C;
constexpr std::uint32_t kRxgfc = 0x80;
constexpr std::uint32_t kXidam = 0x84;
constexpr std::uint32_t kHpms = 0x88;
constexpr std::uint32_t kRxf0s = 0x90;
constexpr std::uint32_t kRxf0a = 0x94;
constexpr std::uint32_t kRxf1s = 0x98;
constexpr std::uint32_t kRxf1a = 0x9C;
constexpr std::uint32_t kTxbc = 0xC0;
constexpr std::uint32_t kTxfqs = 0xC4;
constexpr std::uint32_t kTxbrp = 0xC8;
constexpr std::uint32_t kTxbar = 0xCC;
constexpr std::uint32_t kTxbcr = 0xD0;
constexpr std::uint32_t kTxbto = 0xD4;
constexpr std::uint32_t kTxbcf = 0xD8;
constexpr std::uint32_t kTxbtie = 0xDC;
constexpr std::uint32_t kTxbcie = 0xE0;
constexpr std::uint32_t kTxefs = 0xE4;
constexpr std::uint32_t kTxefa = 0xE8;
constexpr std::uint32_t kCkdiv = 0x100;

// Offsets in the message memory.
constexpr std::uint32_t kStandardFilters = 0x000;
constexpr std::uint32_t kExtendedFilters = 0x070;
constexpr std::uint32_t kFifo0 = 0x0B0;
constexpr std::uint32_t kFifo1 = 0x188;
constexpr std::uint32_t kEvents = 0x260;
constexpr std::uint32_t kEventBytes = 8;
constexpr std::uint32_t kBuffers = 0x278;
constexpr std::uint32_t kElement = 72;
constexpr unsigned kDepth = 3;

// Bits of CCCR and DBTP.
constexpr unsigned kInit = 0;
constexpr unsigned kChange = 1;
constexpr unsigned kMonitor = 5;
constexpr unsigned kNoRetransmission = 6;  // DAR
constexpr unsigned kTestOn = 7;
constexpr unsigned kLoopBack = 4;  // of TEST
constexpr unsigned kFdOn = 8;
constexpr unsigned kSwitchOn = 9;
constexpr unsigned kPause = 14;  // TXP. PXHD acts on frames of a later protocol, which no node sends here
constexpr unsigned kCompensation = 23;

// Bits of IR.
constexpr unsigned kNewMessage0 = 0;  // the bits for full and lost follow; those of FIFO 1 are three positions higher
constexpr unsigned kLost0 = 2;
constexpr unsigned kPriority = 6;  // HPM
constexpr unsigned kTransmitted = 7;
constexpr unsigned kCancelled = 8;
constexpr unsigned kQueueEmpty = 9;
constexpr unsigned kNewEvent = 10;  // TEFN; full and lost follow
constexpr unsigned kErrorPassive = 17;
constexpr unsigned kWarning = 18;
constexpr unsigned kBusOff = 19;
constexpr unsigned kProtocolError = 21;

/// Interrupts of each group of ILS.
constexpr std::array<std::uint32_t, 7> kGroups{0x7, 0x38, 0x1C0, 0x1E00, 0xE000, 0x30000, 0xFC0000};

inline std::vector<Register> registers() {
    return {{0x00, 0x32141218, "CREL", kAllBits},
            {0x04, 0x87654321, "ENDN", kAllBits},
            {kDbtp, 0x00000A33, "DBTP", 0x009F1FFF},
            {kTest, 0, "TEST", 0x90, "TX@5-6"},
            {0x14, 0, "RWD", 0, "WDC@0-7"},
            {kCccr, 1, "CCCR", 0x53FB, "ASM@2 EFBI@13 NISO@15"},
            {kNbtp, 0x06000A03, "NBTP", 0xFFFFFF7F},
            {0x20, 0, "TSCC", 0, "TSS@0-1 TCP@16-19"},
            {0x24, 0, "TSCV", kAllBits},
            {0x28, 0xFFFF0000, "TOCC", 0, "ETOC@0 TOS@1-2 TOP@16-31"},
            {0x2C, 0xFFFF, "TOCV", kAllBits},
            {kEcr, 0, "ECR", kAllBits},
            {kPsr, 0x707, "PSR", kAllBits},
            {kTdcr, 0, "TDCR", 0x7F7F},
            {kIr, 0, "IR", kAllBits},
            {kIe, 0, "IE", 0x2E1FFF, "TSWE@13 MRAFE@14 TOOE@15 ELOE@16 WDIE@20 PEDE@22 ARAE@23"},
            {kIls, 0, "ILS", 0x7F},
            {kIle, 0, "ILE", 0x3},
            {kRxgfc, 0, "RXGFC", 0x0F1F033F},
            {kXidam, 0x1FFFFFFF, "XIDAM", 0x1FFFFFFF},
            {kHpms, 0, "HPMS", kAllBits},
            {kRxf0s, 0, "RXF0S", kAllBits},
            {kRxf0a, 0, "RXF0A", 0x7},
            {kRxf1s, 0, "RXF1S", kAllBits},
            {kRxf1a, 0, "RXF1A", 0x7},
            {kTxbc, 0, "TXBC", 1U << 24U},
            {kTxfqs, 3, "TXFQS", kAllBits},
            {kTxbrp, 0, "TXBRP", kAllBits},
            {kTxbar, 0, "TXBAR", 0x7},
            {kTxbcr, 0, "TXBCR", 0x7},
            {kTxbto, 0, "TXBTO", kAllBits},
            {kTxbcf, 0, "TXBCF", kAllBits},
            {kTxbtie, 0, "TXBTIE", 0x7},
            {kTxbcie, 0, "TXBCIE", 0x7},
            {kTxefs, 0, "TXEFS", kAllBits},
            {kTxefa, 0, "TXEFA", 0x3},
            {kCkdiv, 0, "CKDIV", 0xF}};
}

/// From TX to RX through the transceiver, ISO 11898-2: maximum.
constexpr double kLongestLoopDelayS = 255e-9;

// Error counts at which the state changes.
constexpr int kPassiveAt = 128;
constexpr int kWarningAt = 96;
constexpr int kOffAt = 256;
/// Bytes of each data length code.
constexpr std::array<unsigned, 16> kBytes{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

}  // namespace tricoil::virtual_board::fdcan
