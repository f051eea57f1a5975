// Peripherals whose registers only store the written values.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Peripheral without behaviour that this model simulates.
class StoredRegisters final : public RegisterPeripheral {
public:
    using RegisterPeripheral::RegisterPeripheral;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        write(offset & ~3U, with_part(registers_.at(offset & ~3U), offset, value, bytes));
    }
    void reset() override {
        RegisterPeripheral::reset();
        on_change();
    }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t offset) const { return registers_[offset]; }

    /// Called after each write and reset.
    std::function<void()> on_change = [] {};

private:
    void apply(std::uint32_t offset, std::uint32_t value) override {
        RegisterPeripheral::apply(offset, value);
        on_change();
    }
};

/// Clock recovery system (RM0440 section 8): trims the 48 MHz oscillator by the host's start-of-frame packets; here the
/// oscillator is exact.
inline StoredRegisters clock_recovery() {
    return StoredRegisters({{0x00, 0x4000, "CR", 0x7F60, "SYNCOKIE@0 SYNCWARNIE@1 ERRIE@2 ESYNCIE@3 SWSYNC@7"},
                            {0x04, 0x2022BB7F, "CFGR", kAllBits},
                            {0x08, 1, "ISR", kAllBits},
                            {0x0C, 0, "ICR", kAllBits}});
}

/// System configuration (RM0440 section 10). EXTICR selects the ports of the interrupt lines, FB_MODE the bank at the start of
/// the flash.
inline StoredRegisters system_configuration() {
    return StoredRegisters({{0x00, 0, "MEMRMP", 0x100, "MEM_MODE@0-2"},
                            {0x04, 0x7C000001, "CFGR1", kAllBits},
                            {0x08, 0, "EXTICR1", 0x7777},
                            {0x0C, 0, "EXTICR2", 0x7777},
                            {0x10, 0, "EXTICR3", 0x7777},
                            {0x14, 0, "EXTICR4", 0x7777},
                            {0x18, 0, "SCSR", 0, "CCMER@0 CCMBSY@1"},
                            {0x1C, 0, "CFGR2", 0, "CLL@0 SPL@1 PVDL@2 ECCL@3 SPF@8"},
                            {0x20, 0, "SWPR", 0, "PAGE@0-31"},
                            {0x24, 0, "SKR", 0, "KEY@0-7"}});
}

/// Debug unit (RM0440 section 47): identity of the chip; the rest acts only while a debugger is attached.
inline StoredRegisters debug_unit() {
    return StoredRegisters({{0x00, 0x20036469, "IDCODE", 0, "IDCODE@0-31"},
                            {0x04, 0, "CR", kAllBits},
                            {0x08, 0, "APB1FZR1", kAllBits},
                            {0x0C, 0, "APB1FZR2", kAllBits},
                            {0x10, 0, "APB2FZR", kAllBits}});
}

}  // namespace tricoil::virtual_board
