// Peripherals that only store their registers: their functions have no effect in this model.
#pragma once

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

template <std::size_t kWords>
class StoredRegisters final : public Peripheral {
public:
    StoredRegisters(std::initializer_list<typename RegisterFile<kWords>::Reset> registers) : registers_(registers) {}
    std::uint32_t read(std::uint32_t offset) override { return registers_.at(offset); }
    void write(std::uint32_t offset, std::uint32_t value) override { registers_.at(offset) = value; }
    void reset() override { registers_.reset(); }

private:
    RegisterFile<kWords> registers_;
};

/// Clock recovery system (RM0440 section 8): trims the 48 MHz oscillator by the host's start-of-frame packets; here the
/// oscillator is exact.
inline StoredRegisters<5> clock_recovery() { return {{0x00, 0x4000}, {0x04, 0x2022BB7F}, {0x08, 1}, {0x0C, 0}}; }
/// System configuration (RM0440 section 10).
inline StoredRegisters<8> system_configuration() {
    return {{0x00, 0}, {0x04, 0x7C000001}, {0x08, 0}, {0x0C, 0}, {0x10, 0}, {0x14, 0}, {0x18, 0}, {0x1C, 0}};
}

}  // namespace tricoil::virtual_board
