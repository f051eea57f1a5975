// Memory that the processor reads and runs without any peripheral behind it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tricoil::virtual_board {

/// Of an STM32G474RE: flash bank 1, from which code runs, also seen at 0; 128 KiB of RAM, its last 32 (CCM SRAM) also at
/// 0x10000000; the system memory with the ROM bootloader and the numbers of the part. Bank 2 is a peripheral, since it can have
/// errors.
struct Memory {
    static constexpr std::uint32_t kFlashBase = 0x08000000;
    static constexpr std::uint32_t kBankBytes = 256 * 1024;
    static constexpr std::uint32_t kRamBase = 0x20000000;
    static constexpr std::uint32_t kRamBytes = 128 * 1024;
    static constexpr std::uint32_t kCcmBase = 0x10000000;
    static constexpr std::uint32_t kCcmBytes = 32 * 1024;
    static constexpr std::uint32_t kSystemBase = 0x1FFF0000;
    static constexpr std::uint32_t kSystemBytes = 0x8000;

    Memory();

    /// Memory that `size` bytes at this address are in, as the host holds it; empty: none of it is.
    std::span<std::uint8_t> at(std::uint32_t address, std::uint32_t size);
    [[nodiscard]] std::uint32_t word(std::uint32_t address);

    /// What RAM holds before anything is written: never zeros, and the same in every run.
    static constexpr std::uint8_t kNeverWritten = 0xC5;
    void lose_ram();

    std::vector<std::uint8_t> flash;
    std::vector<std::uint8_t> ram;
    std::vector<std::uint8_t> system;
};

}  // namespace tricoil::virtual_board
