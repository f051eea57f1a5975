// From a configuration to what the device loop takes: its parameters, and the lines that this host switches.
#pragma once

#include <optional>

#include "board/linux/device_config.hpp"
#include "board/linux/device_loop.hpp"
#include "core/calibration/calibration.hpp"
#include "drivers/gpiod/gpio_coil_driver.hpp"
#include "drivers/gpiod/gpio_signals.hpp"

namespace tricoil::linux_board {

/// calibration: what config.calibration holds. Throws InputError for an unknown tracker, or for a calibration that this
/// tracker cannot take: what it says is refused, not left out.
DeviceLoopParams loop_params(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration);

/// Coil, heartbeat and sync lines; released with the object.
class OpenLines {
public:
    /// None if nothing is wanted. Throws DeviceError naming the line that could not be taken.
    explicit OpenLines(const std::optional<CoilLines>& wanted);

    [[nodiscard]] const HostLines& lines() const { return lines_; }

private:
    drivers::GpioCoilDriver coils_;
    drivers::GpioHeartbeat heartbeat_;
    drivers::GpioSyncLine sync_;
    HostLines lines_;
};

}  // namespace tricoil::linux_board
