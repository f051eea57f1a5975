// `tricoil run --device`: tracks columns of a front end, or receives poses of a tracker board.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "board/linux/device_config.hpp"
#include "board/pose_text/output_format.hpp"
#include "board/stream/stream_loop.hpp"
#include "core/calibration/calibration.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

struct DeviceRunOptions {
    DeviceConfig config;
    std::optional<calibration::Calibration<double>> calibration;  // content of the file config.calibration
    double duration_s = 0;                                        // device time, then host time if it stops; 0: until a signal
    double wait_s = 5;                                            // wait for the device at the start; 0: no limit
    double give_up_after_s = 0;                                   // time without a steady device; 0: never
    bool json = false;                                            // poses and summary to standard output
    bool json_lines = false;                                      // poses with their UTC to standard output
    host::OutputOptions output;                   // of CSV and JSON, tips also on the link; `tap` gets the poses of the sensors
    std::string record;                           // folder; empty: none
    tracking::TrackerTap<double>* tap = nullptr;  // receives inputs and outputs of the trackers
    host::LoopParams loop;                        // duration, health limits and outputs are set by the run
};

/// Describes the origin of the columns, for a recording.
nlohmann::ordered_json describe_source(const DeviceConfig& config);

/// Returns the exit code. Throws InputError for invalid options, DeviceError if the device does not connect or lines are in use.
int run_device(const DeviceRunOptions& options);

}  // namespace tricoil::linux_board
