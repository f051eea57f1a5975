// Register offsets and bits of the timers (RM0440 sections 28 to 30).
#pragma once

#include <cstdint>

namespace tricoil::virtual_board::timer {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr2 = 0x04;
constexpr std::uint32_t kSmcr = 0x08;
constexpr std::uint32_t kDier = 0x0C;
constexpr std::uint32_t kSr = 0x10;
constexpr std::uint32_t kEgr = 0x14;
constexpr std::uint32_t kModes = 0x18;  // CCMR1, CCMR2
constexpr std::uint32_t kCcer = 0x20;
constexpr std::uint32_t kCnt = 0x24;
constexpr std::uint32_t kPsc = 0x28;
constexpr std::uint32_t kArr = 0x2C;
constexpr std::uint32_t kRcr = 0x30;
constexpr std::uint32_t kBdtr = 0x44;
constexpr std::uint32_t kInputs = 0x5C;  // TISEL
constexpr std::uint32_t kModes3 = 0x50;  // CCMR3
constexpr std::uint32_t kDcr = 0x3DC;
constexpr std::uint32_t kDmar = 0x3E0;
constexpr std::uint32_t compare(unsigned channel) { return 0x34 + 4 * channel + (channel > 3 ? 4 : 0); }  // CCRx
constexpr unsigned channel_of(std::uint32_t offset) { return (offset - 0x34) / 4 - (offset > kBdtr ? 1 : 0); }
constexpr std::uint32_t modes(unsigned channel) { return channel > 3 ? kModes3 : kModes + 4 * (channel / 2); }  // CCMRx
constexpr std::uint32_t compare_flag(unsigned channel) { return channel > 3 ? 0x1000U << channel : 2U << channel; }

constexpr unsigned kNoUpdates = 1;      // UDIS
constexpr unsigned kOnlyOverflows = 2;  // URS
constexpr unsigned kOnePulse = 3;
constexpr unsigned kPreload = 7;
constexpr unsigned kUpdateDma = 8;
constexpr unsigned kDown = 4;  // DIR
constexpr unsigned kDither = 12;
constexpr std::uint32_t kUpdateBurst = 1;  // DCR.DBSS; those of the channels follow

/// Trigger outputs (CR2.MMS) and slave modes (SMCR.SMS).
enum TriggerMode : std::uint32_t { by_reset, by_enable, by_update };
enum SlaveMode : std::uint32_t { free_running, encoder = 3, reset_by_trigger, gated, start_by_trigger, count_triggers };

}  // namespace tricoil::virtual_board::timer
