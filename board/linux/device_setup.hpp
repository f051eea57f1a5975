// Converts a configuration to parameters and GPIO lines of the device loop.
#pragma once

#include <memory>
#include <optional>

#include "board/linux/device_config.hpp"
#include "board/linux/device_loop.hpp"
#include "core/calibration/calibration.hpp"
#include "hal/coil_driver.hpp"
#include "hal/heartbeat.hpp"
#include "hal/sync_line.hpp"

namespace tricoil::linux_board {

/// calibration: content of the file config.calibration. Throws InputError for an unknown tracker, or for a calibration that this
/// tracker does not support.
DeviceLoopParams loop_params(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration);

/// Coil, heartbeat and sync lines. The destructor releases them.
class OpenLines {
public:
    /// Opens no line if `wanted` is empty. Throws DeviceError that names a line that could not be opened.
    explicit OpenLines(const std::optional<CoilLines>& wanted);

    [[nodiscard]] const HostLines& lines() const { return lines_; }

private:
    std::unique_ptr<hal::CoilDriver> coils_;
    std::unique_ptr<hal::Heartbeat> heartbeat_;
    std::unique_ptr<hal::SyncLine> sync_;
    HostLines lines_;
};

}  // namespace tricoil::linux_board
