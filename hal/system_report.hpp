// State of a processor for its user: last program error, image, and settings that survive power-off.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"

namespace tricoil::hal {

/// Last program error since power-on. A number that is zero is unknown.
struct CrashRecord {
    enum class Kind : std::uint8_t {
        none,
        fault,      // exception of the processor, described by all numbers
        assertion,  // `pc`: after the call of assertion_failed()
        watchdog,   // the program hung; its place is not known
        stack,      // stack overflow
    };
    Kind kind = Kind::none;
    std::uint16_t count = 0;      // errors since power-on
    std::uint16_t exception = 0;  // number
    std::uint32_t pc = 0;
    std::uint32_t lr = 0;
    std::uint32_t cfsr = 0;     // fault status (ARMv7-M B3.2.15)
    std::uint32_t address = 0;  // of the failed access
};

enum class ImageState : std::uint8_t { unchecked, sound, damaged };

/// Settings that are not those of a tracker board (bit numbers).
enum class SettingFault : std::uint8_t {
    brown_out,   // the processor runs at a supply at which flash operations and coils are undefined
    readout_1,   // read protection: the image can be replaced only after an erase of the whole flash
    readout_2,   // permanent read protection
    one_bank,    // the calibration cannot be stored
    other_bank,  // the processor boots from the memory of the calibration
    no_flash,    // the processor does not boot from the flash
};
using SettingFaults = FlagSet<SettingFault>;

struct SystemReport {
    CrashRecord crash;
    ImageState image = ImageState::unchecked;
    std::uint32_t image_crc = 0;  // CRC-32 as computed at boot
    bool has_settings = false;    // false: the rest is not known
    std::uint32_t settings = 0;   // as stored
    SettingFaults setting_faults;
};

}  // namespace tricoil::hal
