// Memory protection unit (ARMv7-M B3.5), 0xE000ED90-0xE000EDB8.
#pragma once

#include <array>
#include <cstdint>

#include "sim/virtual_board/machine/memory.hpp"
#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

/// For the list of registers.
constexpr std::array<Register, 5> kMpuRegisters{{{0x90, 0x800, "MPU_TYPE", 0},
                                                 {0x94, 0, "MPU_CTRL", 0x5, "HFNMIENA@1"},
                                                 {0x98, 0, "MPU_RNR", 0x7},
                                                 {0x9C, 0, "MPU_RBAR", 0xFFFFFFFF},
                                                 {0xA0, 0, "MPU_RASR", 0x173F003F, "SRD@8-15"}}};

/// Models the regions that forbid something which this machine cannot do either: any access to addresses without memory, and code
/// in RAM. They cost no time: an access is checked only after the machine has refused it. Other regions that forbid something are
/// doubtful; a map without PRIVDEFENA ends the run.
class Mpu {
public:
    static constexpr std::uint32_t kFirst = 0x90;  // offsets in the system control block
    static constexpr std::uint32_t kLast = 0xB8;

    std::uint32_t read(std::uint32_t offset) const {
        const std::uint32_t region = (offset - kBase) % 8 == 0 ? regions_[number_].base | number_ : regions_[number_].attributes;
        const auto types = static_cast<std::uint32_t>(regions_.size()) << 8U;
        return offset == kType ? types : offset == kControl ? control_ : offset == kNumber ? number_ : region;
    }
    void write(std::uint32_t offset, std::uint32_t value) {
        if (offset == kControl || offset == kNumber) {
            kMpuRegisters[(offset - kType) / 4].check(value);
            if (offset == kNumber) {
                number_ = value;
                return;
            }
            fail_if((value & (kEnable | kDefaultMap)) == kEnable,
                    "MPU_CTRL enables a map without PRIVDEFENA, which is not in this model");
            control_ = value;
        } else if (offset >= kBase && (offset - kBase) % 8 == 0) {
            number_ = (value & kRegionIsValid) != 0 ? value & 7U : number_;
            regions_[number_].base = value & ~0x1FU;
        } else if (offset >= kBase) {
            kMpuRegisters[4].check(value);
            regions_[number_].attributes = value;
        } else {
            throw RunFailure("the register is read-only");
        }
        for (const auto check : {check_place, check_effect}) {  // a doubtful region does not hide a wrong one
            for (const Region& region : regions_) {
                if ((control_ & kEnable) != 0 && is_on(region)) {
                    check(region);
                }
            }
        }
    }
    void reset() { *this = {}; }

    /// True if a region forbids the access: a MemManage fault instead of a bus fault.
    [[nodiscard]] bool forbids(std::uint32_t address, bool is_fetch) const {
        if ((control_ & kEnable) == 0) {
            return false;
        }
        for (auto region = regions_.rbegin(); region != regions_.rend(); ++region) {  // the highest number counts
            if (is_on(*region) && address - region->base < size_of(*region)) {
                const bool none = (region->attributes & kAccess) == 0;
                return none || (is_fetch && (region->attributes & kNoExecute) != 0);
            }
        }
        return false;
    }

private:
    static constexpr std::uint32_t kType = 0x90;
    static constexpr std::uint32_t kControl = 0x94;
    static constexpr std::uint32_t kNumber = 0x98;
    static constexpr std::uint32_t kBase = 0x9C;  // and kAttributes: repeated three times
    static constexpr std::uint32_t kEnable = 1U << 0U;
    static constexpr std::uint32_t kDefaultMap = 1U << 2U;  // PRIVDEFENA
    static constexpr std::uint32_t kRegionIsValid = 1U << 4U;
    static constexpr std::uint32_t kNoExecute = 1U << 28U;
    static constexpr std::uint32_t kAccess = 7U << 24U;        // AP; 0: none, 1 to 3: the privileged program may read and write
    static constexpr std::uint32_t kMinSize = 4;               // 32 bytes
    static constexpr std::uint32_t kPeripherals = 0x40000000;  // from here on no code can run in any case
    static bool overlaps(std::uint32_t a, std::uint64_t bytes_a, std::uint32_t b, std::uint64_t bytes_b) {
        return a < b + bytes_b && b < a + bytes_a;
    }

    struct Region {
        std::uint32_t base = 0;
        std::uint32_t attributes = 0;  // RASR
    };
    [[nodiscard]] static bool is_on(const Region& region) { return (region.attributes & 1U) != 0; }
    [[nodiscard]] static std::uint64_t size_of(const Region& region) {
        return std::uint64_t{2} << (region.attributes >> 1U & 31U);
    }
    static void check_place(const Region& region) {
        const std::uint64_t size = size_of(region);
        fail_if(size < 1U << (kMinSize + 1) || region.base % size != 0,
                "MPU region at {:#010x} of {} bytes: at least 32 bytes, and the address a multiple of the size", region.base,
                size);
    }
    static void check_effect(const Region& region) {
        const std::uint64_t size = size_of(region);
        const std::uint32_t access = (region.attributes & kAccess) >> 24U;
        const bool has_memory = overlaps(region.base, size, 0, Memory::kBankBytes) ||
                                overlaps(region.base, size, Memory::kFlashBase, 2 * Memory::kBankBytes) ||
                                overlaps(region.base, size, Memory::kSystemBase, Memory::kSystemBytes) ||
                                overlaps(region.base, size, Memory::kCcmBase, Memory::kCcmBytes) ||
                                overlaps(region.base, size, Memory::kRamBase, Memory::kRamBytes) ||
                                region.base + size > kPeripherals;
        const bool is_ram = Memory::is_ram(region.base) && Memory::is_ram(static_cast<std::uint32_t>(region.base + size - 1));
        const bool forbids_code_only =
            access >= 1 && access <= 3 && (is_ram || region.base >= kPeripherals || (region.attributes & kNoExecute) == 0);
        doubt_if(has_memory && !forbids_code_only,
                 fmt::format("MPU region at {:#010x} forbids access to memory, which is not in this model", region.base));
    }

    std::array<Region, 8> regions_{};
    std::uint32_t control_ = 0;
    std::uint32_t number_ = 0;
};

}  // namespace tricoil::virtual_board
