// What one run of the firmware leaves to the next: a request, or how it ended.
#pragma once

#include <cstdint>

namespace tricoil::nucleo_g474re {

/// Lies in RAM that no start-up code clears. After power-on it holds anything: only the exact words count.
struct BootRecord {
    static constexpr std::uint32_t kEnterLoader = 0x10ADE2B0;
    static constexpr std::uint32_t kFaulted = 0xFA017ED5;

    std::uint32_t request;  // kEnterLoader or nothing
    std::uint32_t ending;   // kFaulted: a fault, of which:
    std::uint32_t exception;
    std::uint32_t pc;
    std::uint32_t lr;
    std::uint32_t cfsr;  // ARMv7-M B3.2.15
};

extern BootRecord boot_record;

}  // namespace tricoil::nucleo_g474re
