// Memory without peripheral behaviour: code and data.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tricoil::virtual_board {

/// Memory of an STM32G474RE: flash bank 1, which holds the code, aliased at 0; 128 KiB of RAM, the last 32 KiB (CCM SRAM) aliased
/// at 0x10000000; the system memory with the ROM bootloader and the device signature. Bank 2 is a peripheral, because it can have
/// errors.
struct Memory {
    static constexpr std::uint32_t kFlashBase = 0x08000000;
    static constexpr std::uint32_t kBankBytes = 256 * 1024;
    static constexpr std::uint32_t kRamBase = 0x20000000;
    static constexpr std::uint32_t kRamBytes = 128 * 1024;
    static constexpr std::uint32_t kRamBitsBase = 0x22000000;  // bit-band
    static constexpr std::uint32_t kCcmBase = 0x10000000;
    static constexpr std::uint32_t kCcmBytes = 32 * 1024;
    static constexpr std::uint32_t kSystemBase = 0x1FFF0000;
    static constexpr std::uint32_t kSystemBytes = 0x8000;

    static constexpr std::uint32_t kUserOptions = 0xFFEFF8AA;  // option bytes of the factory

    Memory();

    [[nodiscard]] static constexpr bool is_ram(std::uint32_t address) {
        return address - kRamBase < kRamBytes || address - kCcmBase < kCcmBytes;
    }
    /// Host memory of `size` bytes at this address; empty if a part of it is outside memory.
    std::span<std::uint8_t> at(std::uint32_t address, std::uint32_t size);
    [[nodiscard]] std::uint32_t word(std::uint32_t address);
    /// Option bytes in the system memory: the word and its complement.
    void set_options(std::uint32_t options);

    /// Initial content of RAM: not zero, and the same in every run.
    static constexpr std::uint8_t kNeverWritten = 0xC5;
    void lose_ram();

    std::vector<std::uint8_t> flash;
    std::vector<std::uint8_t> ram;
    std::vector<std::uint8_t> system;
};

}  // namespace tricoil::virtual_board
