// Memory without peripheral behaviour: code and data.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace tricoil::virtual_board {

/// Memory of an STM32G474RE: the flash bank that runs, aliased at 0; 128 KiB of RAM, the last 32 KiB (CCM SRAM) aliased
/// at 0x10000000; the system memory with the ROM bootloader and the device signature. The other bank is a peripheral, because it
/// can have errors; so are the data pages of the bank that runs, which hold no code.
struct Memory {
    static constexpr std::uint32_t kFlashBase = 0x08000000;
    static constexpr std::uint32_t kBankBytes = 256 * 1024;
    struct Part {
        std::uint32_t offset;
        std::uint32_t bytes;
    };
    /// Data pages of a tracker board (board/stm32g4/flash_layout.hpp): the log of the banks, and the settings.
    static constexpr std::array<Part, 2> kDataPages{{{0x1000, 0x1000}, {0x3E000, 0x2000}}};
    static constexpr std::uint32_t kRamBase = 0x20000000;
    static constexpr std::uint32_t kRamBytes = 128 * 1024;
    static constexpr std::uint32_t kRamBitsBase = 0x22000000;  // bit-band
    static constexpr std::uint32_t kCcmBase = 0x10000000;
    static constexpr std::uint32_t kCcmBytes = 32 * 1024;
    static constexpr std::uint32_t kSystemBase = 0x1FFF0000;
    static constexpr std::uint32_t kSystemBytes = 0x8000;

    static constexpr std::uint32_t kUserOptions = 0xFFEFF8AA;  // option bytes of the factory

    Memory() : flash(kBankBytes, 0xFF), ram(kRamBytes), system(kSystemBytes, 0xFF) {
        lose_ram();
        put(system, 0, kRamBase + 0x3000);
        put(system, 4, kSystemBase + kBootloaderEntry + 1);
        put(system, kBootloaderEntry, 0xE7FEE7FE);  // b .
        put(system, kUniqueId, 0x00470047);         // wafer x, y
        put(system, kUniqueId + 4, 0x56425254);     // lot number, ASCII
        put(system, kUniqueId + 8, 0x304C4F43);
        put(system, kFlashSize, 512);
        set_options(kUserOptions);
        put(system, kThermometer30, 1654U << 16U | 1038U);     // 1.212 V, 0.76 V
        put(system, kThermometer130, 1379U << 16U | 0xFFFFU);  // 1.01 V at 130 degrees: 2.5 mV per degree
    }

    [[nodiscard]] static constexpr bool is_ram(std::uint32_t address) {
        return address - kRamBase < kRamBytes || address - kCcmBase < kCcmBytes;
    }
    /// Host memory of `size` bytes at this address; empty if a part of it is outside memory.
    std::span<std::uint8_t> at(std::uint32_t address, std::uint32_t size) {
        const auto part = [&](std::vector<std::uint8_t>& memory, std::uint32_t base, std::uint32_t bytes, std::uint32_t skip) {
            const bool inside = address >= base && address - base <= bytes && size <= bytes - (address - base);
            return inside ? std::span(memory).subspan(skip + address - base, size) : std::span<std::uint8_t>{};
        };
        for (const auto found : {part(ram, kRamBase, kRamBytes, 0), part(flash, kFlashBase, kBankBytes, 0),
                                 part(ram, kCcmBase, kCcmBytes, kRamBytes - kCcmBytes),
                                 part(system, kSystemBase, kSystemBytes, 0), part(flash, 0, kBankBytes, 0)}) {
            if (!found.empty()) {
                return found;
            }
        }
        return {};
    }
    [[nodiscard]] std::uint32_t word(std::uint32_t address) {
        const auto bytes = at(address, 4);
        std::uint32_t value = 0xFFFFFFFF;
        if (!bytes.empty()) {
            std::memcpy(&value, bytes.data(), sizeof value);
        }
        return value;
    }
    /// Option bytes in the system memory: the word and its complement.
    void set_options(std::uint32_t options) {
        put(system, kOptionBytes, options);
        put(system, kOptionBytes + 4, ~options);
    }

    /// Initial content of RAM: not zero, and the same in every run.
    static constexpr std::uint8_t kNeverWritten = 0xC5;
    void lose_ram() { std::fill(ram.begin(), ram.end(), kNeverWritten); }

    std::vector<std::uint8_t> flash;
    std::vector<std::uint8_t> ram;
    std::vector<std::uint8_t> system;

private:
    // RM0440 section 48 (device electronic signature).
    // TS_CAL1 and VREFINT_CAL: codes at 30 degrees Celsius and a supply of 3.0 V
    static constexpr std::uint32_t kThermometer30 = 0x75A8;
    static constexpr std::uint32_t kThermometer130 = 0x75C8;  // TS_CAL2 is the upper half-word
    static constexpr std::uint32_t kUniqueId = 0x7590;
    static constexpr std::uint32_t kFlashSize = 0x75E0;
    static constexpr std::uint32_t kOptionBytes = 0x7800;
    // Any address in system memory: the machine detects code that runs there.
    static constexpr std::uint32_t kBootloaderEntry = 0x100;
    static void put(std::vector<std::uint8_t>& memory, std::uint32_t at, std::uint32_t word) {
        std::memcpy(memory.data() + at, &word, sizeof word);
    }
};

}  // namespace tricoil::virtual_board
