// Peripheral bus: address decoding and clock checks.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

/// A device on the bus. `clock_is_on` may be empty: the device always has a clock.
struct Mapping {
    std::string name;
    std::uint32_t base = 0;
    std::uint32_t size = 0;
    Peripheral* device = nullptr;
    std::function<bool()> clock_is_on;
    bool may_be_off = false;  // accesses without its clock are never refused
};

/// All functions throw RunFailure: no peripheral at this address, its clock is off, or it does not support the access.
class Bus {
public:
    /// If set, an access without a clock does what it does on the chip: a write is ignored, a read gives zero. The function gets
    /// a description of the access.
    std::function<void(const std::string&)> on_ignored;
    void attach(Mapping mapping);
    std::uint32_t read(std::uint32_t address, unsigned bytes);
    void write(std::uint32_t address, std::uint32_t value, unsigned bytes);
    void reset();
    [[nodiscard]] const std::vector<Mapping>& mappings() const { return mappings_; }

private:
    Mapping& device_at(std::uint32_t address);
    [[nodiscard]] bool has_clock(const Mapping& m, const char* access, std::uint32_t address) const;

    std::vector<Mapping> mappings_;
    std::size_t last_ = 0;  // index of the mapping found last; most accesses go to the same device
};

}  // namespace tricoil::virtual_board
