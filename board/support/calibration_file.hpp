// Calibration and its fixtures as TOML.
#pragma once

#include <map>
#include <string>

#include "board/support/rigid.hpp"
#include "board/support/stage_errors.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::host {

/// Content of the file: parameters for the tracker, and fixtures for evaluation.
struct CalibrationFile {
    calibration::Calibration<double> calibration;
    std::string model;  // concentric, general, finite, free-motion, grid
    std::map<std::string, Rigid> source_stage;
    std::map<std::string, Rigid> mount_sensor;
    bool stage_turns_left_handed = false;
    StageErrors stage_errors;  // of the set that was used; the flash blob does not contain them
    double residual_rms = 0;   // relative to the couplings
};

std::string to_toml(const CalibrationFile& file);

/// Throws InputError, naming file, line and key, for invalid TOML, missing or unknown keys, and impossible numbers.
CalibrationFile read_calibration(const std::string& path);

}  // namespace tricoil::host
