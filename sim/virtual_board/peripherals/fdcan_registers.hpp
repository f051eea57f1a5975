// Register offsets and bits of the CAN FD controller, and the layout of its message memory (RM0440 section 44).
#pragma once

#include <array>
#include <cstdint>

namespace tricoil::virtual_board::fdcan {

constexpr std::uint32_t kDbtp = 0x0C;
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

// Offsets in the message memory.
constexpr std::uint32_t kStandardFilters = 0x000;
constexpr std::uint32_t kExtendedFilters = 0x070;
constexpr std::uint32_t kFifo0 = 0x0B0;
constexpr std::uint32_t kFifo1 = 0x188;
constexpr std::uint32_t kBuffers = 0x278;
constexpr std::uint32_t kElement = 72;
constexpr unsigned kDepth = 3;

// Bits of CCCR and DBTP.
constexpr unsigned kInit = 0;
constexpr unsigned kChange = 1;
constexpr unsigned kFdOn = 8;
constexpr unsigned kSwitchOn = 9;
constexpr unsigned kCompensation = 23;

// Bits of IR.
constexpr unsigned kNewMessage0 = 0;  // the bits for full and lost follow; those of FIFO 1 are three positions higher
constexpr unsigned kTransmitted = 7;
constexpr unsigned kCancelled = 8;
constexpr unsigned kQueueEmpty = 9;
constexpr unsigned kErrorPassive = 17;
constexpr unsigned kWarning = 18;
constexpr unsigned kBusOff = 19;
constexpr unsigned kProtocolError = 21;

// Error counts at which the state changes.
constexpr int kPassiveAt = 128;
constexpr int kWarningAt = 96;
constexpr int kOffAt = 256;
/// Bytes of each data length code.
constexpr std::array<unsigned, 16> kBytes{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

}  // namespace tricoil::virtual_board::fdcan
