// Flash of a tracker board. Both banks hold a program at the same offset. Bank 1 also holds the selector of the bank and its log,
// which an update does not change.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32g4/registers/flash.hpp"

namespace tricoil::stm32g4_board {

// Offsets in a bank; also in link.ld.in, toolchain/image-seal and toolchain/image-info.
constexpr std::size_t kLogOffset = 0x1000;
constexpr std::size_t kProgramOffset = 0x2000;  // of the vectors
constexpr std::size_t kImageHeaderOffset = 0x2200;

constexpr std::uint8_t kLogPage = kLogOffset / stm32g4::kFlashPageBytes;
constexpr std::uint8_t kFirstProgramPage = kProgramOffset / stm32g4::kFlashPageBytes;
constexpr std::uint8_t kFirstStoragePage = 124;  // of bank 2: two pages of parameters, two of the calibration
constexpr std::uint8_t kStoragePages = 4;
constexpr std::size_t kMaxProgramBytes = (kFirstStoragePage - kFirstProgramPage) * stm32g4::kFlashPageBytes;

/// An entry of the log is one of these words, and its complement in the higher word. The newest entry names the bank that runs;
/// without an entry, as after the image was written by a programmer, bank 1 runs.
constexpr std::size_t kLogEntries = stm32g4::kFlashPageBytes / sizeof(std::uint64_t);
constexpr std::uint32_t kBankEntry[2] = {0x6AB1'C93D, 0x17D2'5E86};

/// What vectors begin with: the first address after the stack, in RAM, and the start of a program in Thumb state.
constexpr bool is_program(std::uint32_t stack, std::uint32_t start) {
    return stack - 0x2000'0001U < 128 * 1024 && (start & 1U) != 0 && start - stm32g4::kFlash < stm32g4::kFlashBankBytes;
}

}  // namespace tricoil::stm32g4_board
