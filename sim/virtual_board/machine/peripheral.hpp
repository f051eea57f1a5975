// Interface of a memory-mapped peripheral.
#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <span>
#include <sstream>
#include <string>

#include "core/base/interface.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

constexpr std::uint32_t kAllBits = 0xFFFF'FFFF;

/// A register and the bits that the model knows: their effect is modelled, or nothing that is simulated depends on them.
struct Register {
    std::uint32_t offset = 0;
    std::uint32_t reset = 0;
    const char* name = "";
    std::uint32_t modelled = 0;
    const char* others = "";  // fields that are not modelled: "ARPE@7 CKD@8-9"

    /// Throws RunFailure, with the names of register and field, if `value` changes a bit that is not modelled.
    void check(std::uint32_t value) const {
        if (((value ^ reset) & ~modelled) != 0) {
            refuse(value);
        }
    }

private:
    [[noreturn]] void refuse(std::uint32_t value) const {
        const int bit = std::countr_zero((value ^ reset) & ~modelled);
        std::string field = "reserved";
        std::istringstream fields(others);
        for (std::string one; fields >> one;) {
            const std::size_t at = one.find('@');
            const int first = std::stoi(one.substr(at + 1));
            const std::size_t dash = one.find('-', at);
            const int last = dash == std::string::npos ? first : std::stoi(one.substr(dash + 1));
            if (bit >= first && bit <= last) {
                field = one.substr(0, at);
            }
        }
        throw RunFailure(fmt::format("{}: bit {} ({}) is not in this model", name, bit, field));
    }
};

/// Registers of 32 bits at offsets from a base. An unknown offset throws RunFailure.
class Peripheral : public Interface {
public:
    virtual std::uint32_t read(std::uint32_t offset) = 0;
    virtual void write(std::uint32_t offset, std::uint32_t value) = 0;
    /// A write of 1 or 2 bytes. The default throws RunFailure, because few registers allow it.
    virtual void write_narrow(std::uint32_t offset, [[maybe_unused]] std::uint32_t value, unsigned bytes) {
        throw RunFailure(fmt::format("{}-byte write to a 4-byte register at offset {:#x}", bytes, offset));
    }
    /// The registers, for lists. Empty for memories.
    [[nodiscard]] virtual std::span<const Register> registers() const { return {}; }
    /// State after power-on or a system reset.
    virtual void reset() = 0;
};

}  // namespace tricoil::virtual_board
