// CRC-32 of words in the hardware.
#pragma once

#include "drivers/stm32g4/registers/crc.hpp"

namespace tricoil::stm32g4 {

/// CRC-32 of IEEE 802.3, as in core/base/crc32.hpp, of words in little-endian order. The clock of the unit must be on, and its
/// polynomial and initial value those of a reset.
class CrcUnit {
public:
    explicit CrcUnit(CrcRegisters& registers) : registers_(registers) {
        registers_.CR = crc::CR_RESET | crc::CR_REV_IN_word | crc::CR_REV_OUT;
    }
    void add(std::uint32_t word) { registers_.DR = word; }
    [[nodiscard]] std::uint32_t value() const { return ~registers_.DR; }

private:
    CrcRegisters& registers_;
};

}  // namespace tricoil::stm32g4
