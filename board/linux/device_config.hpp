// Configuration of a Linux board in TOML: link, coil lines, front end, calibration, outputs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "board/support/link_health.hpp"
#include "core/linear/matrix.hpp"
#include "core/protocol/parameters.hpp"
#include "drivers/gpiod/gpio_lines.hpp"

namespace tricoil::linux_board {

struct CoilLines {
    std::array<drivers::GpioLineName, 3> coils;
    std::optional<drivers::GpioLineName> heartbeat;
    std::optional<drivers::GpioLineName> sync;
};

struct DeviceConfig {
    std::string device;              // URI; empty: not configured
    std::optional<CoilLines> coils;  // none: the front end drives the coils
    std::uint64_t serial = 0;        // serial number of the front end; 0: any
    double coupling_constant_m3 = 6.75e-3;
    std::string wiring;       // output file of tricoil calibrate wiring; empty: straight
    std::string calibration;  // output file of tricoil calibrate; empty: none
    std::string method = "direct";
    std::optional<Vec3<double>> hemisphere;  // none: that of the calibration, or +x
    bool confined = false;                   // the sensor never leaves the half space `hemisphere`
    host::HealthLimits health;
    std::string csv;                  // empty: none
    bool publish = false;             // send poses on the link
    int priority = 0;                 // SCHED_FIFO; 0: normal scheduling
    std::optional<bool> lock_memory;  // none: if permitted
};

/// Throws InputError with FILE:LINE for a key that is unknown, missing or out of range.
DeviceConfig load_device_config(const std::string& path);

/// The same from text. `name`: file name for messages.
DeviceConfig parse_device_config(const std::string& name, std::string_view text);

/// Sets config.device to `name` without its keys ",hemisphere=X/Y/Z" (direction, source frame), ",wiring=FILE" and ",confined",
/// and the members of these names to their values. Throws InputError that names the invalid part.
void set_device(DeviceConfig& config, const std::string& name);

/// Direction X/Y/Z; `name`: of the device, for messages. Throws InputError for any other text.
Vec3<double> direction_of(const std::string& name, std::string_view text);

// Parameters that a tracker board keeps: device_parameters.cpp.

std::string parameters_toml(const protocol::ParameterValues& values);
/// Of words KEY=VALUE, one a line.
std::string parameters_toml(std::span<const std::string> words);
/// `values` with the keys of a text; throws InputError like parse_device_config(), and, if `is_whole`, for a missing key.
protocol::ParameterValues parameters_of(const std::string& file, const std::string& text, protocol::ParameterValues values,
                                        bool is_whole);

}  // namespace tricoil::linux_board
