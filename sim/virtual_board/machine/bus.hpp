// Which peripheral answers at which address, and whether it may be used yet.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

/// A device on the bus. `clock_is_on` empty: it always has one.
struct Mapping {
    std::string name;
    std::uint32_t base = 0;
    std::uint32_t size = 0;
    Peripheral* device = nullptr;
    std::function<bool()> clock_is_on;
};

/// All throw RunFailure: nothing at this address, a clock that is off, an access that the device does not have.
class Bus {
public:
    void attach(Mapping mapping);
    std::uint32_t read(std::uint32_t address, unsigned bytes);
    void write(std::uint32_t address, std::uint32_t value, unsigned bytes);
    void reset();

private:
    Mapping& device_at(std::uint32_t address);

    std::vector<Mapping> mappings_;
    std::size_t last_ = 0;  // found last: most accesses come in rows
};

}  // namespace tricoil::virtual_board
