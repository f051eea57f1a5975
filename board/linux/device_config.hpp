// One TOML file that says what hangs on a Linux board: link, coil lines, front end, calibration, outputs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/geometry/types.hpp"
#include "drivers/gpiod/gpio_lines.hpp"

namespace tricoil::linux_board {

struct CoilLines {
    std::array<drivers::GpioLineName, 3> coils;
    std::optional<drivers::GpioLineName> heartbeat;
    std::optional<drivers::GpioLineName> sync;
};

struct DeviceConfig {
    std::string device;              // URI; empty: not said
    std::optional<CoilLines> coils;  // none: the front end drives them
    std::uint64_t serial = 0;        // of the front end; 0: any
    double coupling_constant_m3 = 6.75e-3;
    std::string calibration;  // a file that tricoil calibrate wrote; empty: none
    std::string method = "direct";
    std::optional<Vec3<double>> hemisphere;  // none: the calibration's, or +x
    std::string csv;                         // empty: none
    bool publish = false;                    // poses back onto the link
    int priority = 0;                        // SCHED_FIFO; 0: ordinary
    std::optional<bool> lock_memory;         // none: where allowed
};

/// Throws InputError: FILE:LINE and the key that is unknown, missing or out of range.
DeviceConfig load_device_config(const std::string& path);

/// The same from text; `name` stands for the file in messages.
DeviceConfig parse_device_config(const std::string& name, std::string_view text);

}  // namespace tricoil::linux_board
