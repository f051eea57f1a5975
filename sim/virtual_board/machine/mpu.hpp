// Memory protection unit (ARMv7-M B3.5), 0xE000ED90-0xE000EDB8.
#pragma once

#include <array>
#include <cstdint>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

/// Models the regions that forbid something which this machine cannot do either: any access to addresses without memory, and code
/// in RAM. They cost no time: an access is checked only after the machine has refused it. All other regions that forbid
/// something, and a map without PRIVDEFENA, end the run.
class Mpu {
public:
    static constexpr std::uint32_t kFirst = 0x90;  // offsets in the system control block
    static constexpr std::uint32_t kLast = 0xB8;

    std::uint32_t read(std::uint32_t offset) const;
    void write(std::uint32_t offset, std::uint32_t value);
    void reset() { *this = {}; }

    /// True if a region forbids the access: a MemManage fault instead of a bus fault.
    [[nodiscard]] bool forbids(std::uint32_t address, bool is_fetch) const;

private:
    struct Region {
        std::uint32_t base = 0;
        std::uint32_t attributes = 0;  // RASR
    };
    [[nodiscard]] static bool is_on(const Region& region) { return (region.attributes & 1U) != 0; }
    [[nodiscard]] static std::uint64_t size_of(const Region& region) {
        return std::uint64_t{2} << (region.attributes >> 1U & 31U);
    }
    void check(const Region& region) const;

    std::array<Region, 8> regions_{};
    std::uint32_t control_ = 0;
    std::uint32_t number_ = 0;
};

/// For the list of registers.
constexpr std::array<Register, 5> kMpuRegisters{{{0x90, 0x800, "MPU_TYPE", 0},
                                                 {0x94, 0, "MPU_CTRL", 0x5, "HFNMIENA@1"},
                                                 {0x98, 0, "MPU_RNR", 0x7},
                                                 {0x9C, 0, "MPU_RBAR", 0xFFFFFFFF},
                                                 {0xA0, 0, "MPU_RASR", 0x173F003F, "SRD@8-15"}}};

}  // namespace tricoil::virtual_board
