#include "sim/virtual_board/machine/bus.hpp"

#include <fmt/format.h>

#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

void Peripheral::write_narrow(std::uint32_t offset, std::uint32_t, unsigned bytes) {
    throw RunFailure(fmt::format("{}-byte write to a 4-byte register at offset {:#x}", bytes, offset));
}

void Bus::attach(Mapping mapping) { mappings_.push_back(std::move(mapping)); }

Mapping& Bus::device_at(std::uint32_t address) {
    const auto holds = [address](const Mapping& m) { return address - m.base < m.size; };
    if (last_ < mappings_.size() && holds(mappings_[last_])) {
        return mappings_[last_];
    }
    for (std::size_t i = 0; i < mappings_.size(); ++i) {
        if (holds(mappings_[i])) {
            last_ = i;
            return mappings_[i];
        }
    }
    throw RunFailure(fmt::format("no peripheral at {:#010x}", address));
}

std::uint32_t Bus::read(std::uint32_t address, unsigned bytes) {
    Mapping& m = device_at(address);
    if (m.clock_is_on && !m.clock_is_on()) {
        throw RunFailure(fmt::format("{}: read at {:#010x} before its clock is on", m.name, address));
    }
    try {
        const std::uint32_t word = m.device->read((address - m.base) & ~3U);
        return bytes == 4 ? word : (word >> 8U * (address & 3U)) & ((1U << 8U * bytes) - 1U);
    } catch (const RunFailure& failure) {
        throw RunFailure(fmt::format("{}: read at {:#010x}: {}", m.name, address, failure.what()));
    }
}

void Bus::write(std::uint32_t address, std::uint32_t value, unsigned bytes) {
    Mapping& m = device_at(address);
    if (m.clock_is_on && !m.clock_is_on()) {
        throw RunFailure(fmt::format("{}: write at {:#010x} before its clock is on", m.name, address));
    }
    try {
        if (bytes == 4) {
            m.device->write(address - m.base, value);
        } else {
            m.device->write_narrow(address - m.base, value, bytes);
        }
    } catch (const RunFailure& failure) {
        throw RunFailure(fmt::format("{}: write at {:#010x}: {}", m.name, address, failure.what()));
    }
}

void Bus::reset() {
    for (const Mapping& m : mappings_) {
        m.device->reset();
    }
}

}  // namespace tricoil::virtual_board
