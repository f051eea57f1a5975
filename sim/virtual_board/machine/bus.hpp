// Peripheral bus: address decoding and clock checks.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

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

struct AbsentPeripheral {
    const char* name;
    std::uint32_t base;
    std::uint32_t size = 0x400;
};
/// Peripherals of the STM32G474 without a model (RM0440, memory map).
inline constexpr std::array<AbsentPeripheral, 25> kAbsent{
    {{"TAMP", 0x40002400},        {"RTC", 0x40002800},    {"WWDG", 0x40002C00},    {"SPI2", 0x40003800},
     {"SPI3", 0x40003C00},        {"I2C1", 0x40005400},   {"I2C2", 0x40005800},    {"I2C3", 0x40007800},
     {"LPTIM1", 0x40007C00},      {"I2C4", 0x40008400},   {"UCPD1", 0x4000A000},   {"VREFBUF", 0x40010030, 0x1D0},
     {"COMP", 0x40010200, 0x100}, {"SPI1", 0x40013000},   {"SPI4", 0x40013C00},    {"SAI1", 0x40015400},
     {"HRTIM1", 0x40016800},      {"CORDIC", 0x40020C00}, {"FMAC", 0x40021400},    {"AES", 0x50060000},
     {"RNG", 0x50060800},         {"FMC", 0xA0000000},    {"QUADSPI", 0xA0001000}, {"FPB", 0xE0002000, 0x1000},
     {"TPIU", 0xE0040000, 0x1000}}};

/// All functions throw RunFailure: no peripheral at this address, its clock is off, or it does not support the access.
class Bus {
public:
    /// If set, a doubtful access does what it does on the chip, and the function gets a line about it. Without a clock a write is
    /// ignored, and a read gives zero.
    std::function<void(const std::string&)> on_doubt;
    void attach(Mapping mapping) { mappings_.push_back(std::move(mapping)); }
    std::uint32_t read(std::uint32_t address, unsigned bytes) {
        Mapping& m = device_at(address);
        std::uint32_t word = 0;
        access(m, "read", address, [&] { word = m.device->read((address - m.base) & ~3U); });
        return bytes == 4 ? word : (word >> 8U * (address & 3U)) & ((1U << 8U * bytes) - 1U);
    }
    void write(std::uint32_t address, std::uint32_t value, unsigned bytes) {
        Mapping& m = device_at(address);
        access(m, "write", address, [&] {
            if (bytes == 4) {
                m.device->write(address - m.base, value);
            } else {
                m.device->write_narrow(address - m.base, value, bytes);
            }
        });
    }
    void reset() {
        for (const Mapping& m : mappings_) {
            m.device->reset();
        }
    }
    [[nodiscard]] const std::vector<Mapping>& mappings() const { return mappings_; }

private:
    Mapping& device_at(std::uint32_t address) {
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
        const auto* const absent =
            std::find_if(kAbsent.begin(), kAbsent.end(), [&](const auto& p) { return address - p.base < p.size; });
        throw RunFailure(absent == kAbsent.end() ? fmt::format("no peripheral at {:#010x}", address)
                                                 : fmt::format("{} at {:#010x} is not in this model", absent->name, address));
    }
    template <typename Act>
    void access(const Mapping& m, const char* kind, std::uint32_t address, Act act) const {
        const auto text = [&](const char* what) { return fmt::format("{}: {} at {:#010x}{}", m.name, kind, address, what); };
        if (m.clock_is_on && !m.clock_is_on()) {
            fail_if(!on_doubt && !m.may_be_off, "{}", text(" before its clock is on"));
            if (on_doubt) {
                on_doubt(text(" before its clock is on: ignored, as on the chip"));
            }
            return;
        }
        try {
            act();
        } catch (const RunFailure& failure) {
            const std::string reason = text(": ") + failure.what();
            if (!on_doubt || dynamic_cast<const Doubt*>(&failure) == nullptr) {
                throw RunFailure(reason);
            }
            on_doubt(reason);
        }
    }

    std::vector<Mapping> mappings_;
    std::size_t last_ = 0;  // index of the mapping found last; most accesses go to the same device
};

}  // namespace tricoil::virtual_board
