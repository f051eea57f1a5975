// Bit-band alias of RAM or peripherals (ARMv7-M B3.1): one word for each bit.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class BitBand final : public Peripheral {
public:
    /// Access to the 4 bytes at an offset from the region's begin.
    BitBand(std::function<std::uint32_t(std::uint32_t)> load, std::function<void(std::uint32_t, std::uint32_t)> store)
        : load_(std::move(load)), store_(std::move(store)) {}

    std::uint32_t read(std::uint32_t offset) override { return flag(is_set(load_(word(offset)), bit(offset)), 0); }
    void write(std::uint32_t offset, std::uint32_t value) override {
        const std::uint32_t others = load_(word(offset)) & ~(1U << bit(offset));
        store_(word(offset), others | (value & 1U) << bit(offset));
    }
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned) override { write(offset & ~3U, value); }
    void reset() override {}

private:
    static std::uint32_t word(std::uint32_t offset) { return offset / 128 * 4; }
    static unsigned bit(std::uint32_t offset) { return offset / 4 % 32; }

    std::function<std::uint32_t(std::uint32_t)> load_;
    std::function<void(std::uint32_t, std::uint32_t)> store_;
};

}  // namespace tricoil::virtual_board
