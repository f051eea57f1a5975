// Interface of a memory-mapped peripheral.
#pragma once

#include <cstdint>

namespace tricoil::virtual_board {

/// Registers of 32 bits at offsets from a base. An unknown offset throws RunFailure.
class Peripheral {
public:
    Peripheral() = default;
    Peripheral(const Peripheral&) = delete;
    Peripheral& operator=(const Peripheral&) = delete;
    virtual ~Peripheral() = default;

    virtual std::uint32_t read(std::uint32_t offset) = 0;
    virtual void write(std::uint32_t offset, std::uint32_t value) = 0;
    /// A write of 1 or 2 bytes. The default throws RunFailure, because few registers allow it.
    virtual void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes);
    /// State after power-on or a system reset.
    virtual void reset() = 0;
};

}  // namespace tricoil::virtual_board
