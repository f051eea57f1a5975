// Peripherals whose registers only store the written values.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

/// Base class. Access to part of a register is refused.
template <std::size_t kWords>
class StoredPeripheral : public Peripheral {
public:
    std::uint32_t read(std::uint32_t offset) final { return registers_.at(offset); }
    void write(std::uint32_t offset, std::uint32_t value) override {
        registers_.check(offset, value);
        registers_.at(offset) = value;
    }
    [[nodiscard]] std::span<const Register> registers() const final { return registers_.list(); }
    void reset() final { registers_.reset(); }

protected:
    StoredPeripheral(std::initializer_list<Register> registers) : registers_(registers) {}
    RegisterFile<kWords> registers_;
};

/// Peripheral without behaviour that this model simulates.
template <std::size_t kWords>
class StoredRegisters final : public StoredPeripheral<kWords> {
    using Base = StoredPeripheral<kWords>;
    using Base::registers_;

public:
    StoredRegisters(std::initializer_list<Register> registers) : Base(registers) {}
    void write(std::uint32_t offset, std::uint32_t value) override {
        Base::write(offset, value);
        if (on_write) {
            on_write();
        }
    }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override {
        const unsigned shift = 8 * (offset & 3U);
        const std::uint32_t mask = ((1U << 8U * bytes) - 1U) << shift;
        write(offset & ~3U, (registers_.at(offset & ~3U) & ~mask) | (value << shift & mask));
    }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t offset) const { return registers_[offset]; }

    /// Called after each write; may be empty.
    std::function<void()> on_write;
};

/// Clock recovery system (RM0440 section 8): trims the 48 MHz oscillator by the host's start-of-frame packets; here the
/// oscillator is exact.
inline StoredRegisters<5> clock_recovery() {
    return {{0x00, 0x4000, "CR", 0x7F60, "SYNCOKIE@0 SYNCWARNIE@1 ERRIE@2 ESYNCIE@3 SWSYNC@7"},
            {0x04, 0x2022BB7F, "CFGR", kAllBits},
            {0x08, 1, "ISR", kAllBits},
            {0x0C, 0, "ICR", kAllBits}};
}

/// System configuration (RM0440 section 10). EXTICR selects the ports of the interrupt lines.
inline StoredRegisters<10> system_configuration() {
    return {{0x00, 0, "MEMRMP", 0, "MEM_MODE@0-2 FB_MODE@8"},
            {0x04, 0x7C000001, "CFGR1", kAllBits},
            {0x08, 0, "EXTICR1", 0x7777},
            {0x0C, 0, "EXTICR2", 0x7777},
            {0x10, 0, "EXTICR3", 0x7777},
            {0x14, 0, "EXTICR4", 0x7777},
            {0x18, 0, "SCSR", 0, "CCMER@0 CCMBSY@1"},
            {0x1C, 0, "CFGR2", 0, "CLL@0 SPL@1 PVDL@2 ECCL@3 SPF@8"},
            {0x20, 0, "SWPR", 0, "PAGE@0-31"},
            {0x24, 0, "SKR", 0, "KEY@0-7"}};
}

/// Debug unit (RM0440 section 47): identity of the chip; the rest acts only while a debugger is attached.
inline StoredRegisters<5> debug_unit() {
    return {{0x00, 0x20036469, "IDCODE", 0, "IDCODE@0-31"},
            {0x04, 0, "CR", kAllBits},
            {0x08, 0, "APB1FZR1", kAllBits},
            {0x0C, 0, "APB1FZR2", kAllBits},
            {0x10, 0, "APB2FZR", kAllBits}};
}

}  // namespace tricoil::virtual_board
