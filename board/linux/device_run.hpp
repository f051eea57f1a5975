// `tricoil run --device`: tracks with real coils, or poses of a tracker board, until told to stop.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "board/linux/device_config.hpp"
#include "board/linux/device_loop.hpp"
#include "core/calibration/calibration.hpp"
#include "hal/tracker_tap.hpp"

namespace tricoil::linux_board {

struct DeviceRunOptions {
    DeviceConfig config;
    std::optional<calibration::Calibration<double>> calibration;  // what config.calibration holds
    double duration_s = 0;                                        // of the device's time; 0: until a signal comes
    double wait_s = 5;                                            // for the device at the start; 0: for ever
    double give_up_after_s = 0;                                   // without a steady device; 0: never
    bool json = false;
    std::string record;                          // folder; empty: none
    hal::TrackerTap<double>* tap = nullptr;      // sees what the trackers are given and answer
    std::function<void(DeviceLoop&)> each_step;  // called between steps; empty: nobody
    std::function<bool()> paused;                // asked between steps: whether to hold, coils off; empty: never
};

/// Where the columns of such a run come from, for a recording.
nlohmann::ordered_json describe_source(const DeviceConfig& config);

/// Returns the exit code. Throws InputError for what cannot be run, DeviceError if the device does not come or lines are taken.
int run_device(const DeviceRunOptions& options);

}  // namespace tricoil::linux_board
