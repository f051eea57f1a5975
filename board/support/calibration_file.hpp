// A calibration and the fixtures it was found with, as TOML.
#pragma once

#include <map>
#include <string>

#include "board/support/rigid.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::host {

/// What the file holds: parameters for the tracker, and for evaluation how source and sensor were mounted.
struct CalibrationFile {
    calibration::Calibration<double> calibration;
    std::string model;  // concentric, general, finite, free-motion, grid
    std::map<std::string, Rigid> source_stage;
    std::map<std::string, Rigid> mount_sensor;
    bool stage_turns_left_handed = false;
    double residual_rms = 0;  // of the couplings, as share
};

std::string to_toml(const CalibrationFile& file);

/// Throws InputError naming file, line and key: not TOML, missing or unknown keys, numbers that cannot be.
CalibrationFile read_calibration(const std::string& path);

}  // namespace tricoil::host
