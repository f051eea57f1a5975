// Calibration and its fixtures as TOML.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "board/support/rigid.hpp"
#include "board/support/stage_errors.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::host {

/// Metal at rest relative to the source, as one dipole (field::induced_dipole).
struct VirtualDipole {
    Vec3<double> position_m = Vec3<double>::Zero();         // source frame
    Mat3<double> polarisability_m3 = Mat3<double>::Zero();  // symmetric
};

/// Model of coils from free motion without a coupling constant: the scale of all lengths is not known.
inline constexpr const char* kFreeMotionModel = "free-motion";

/// Content of the file: parameters for the tracker, and fixtures for evaluation.
struct CalibrationFile {
    calibration::Calibration<double> calibration;
    std::string model;  // concentric, general, finite, free-motion, grid
    std::map<std::string, Rigid> source_stage;
    std::map<std::string, Rigid> mount_sensor;
    bool stage_turns_left_handed = false;
    StageErrors stage_errors;                 // of the set that was used; the flash blob does not contain them
    double residual_rms = 0;                  // relative to the couplings
    std::vector<VirtualDipole> surroundings;  // set_surroundings() sets the dipoles of the tracker from these
};

/// Free motion without a known coupling constant leaves the scale of all lengths open.
inline bool has_free_scale(const CalibrationFile& file) { return file.model == kFreeMotionModel; }

/// Sets the virtual dipoles, also those of the tracker: moments that the source coils of the file induce.
void set_surroundings(CalibrationFile& file, std::vector<VirtualDipole> surroundings);

std::string to_toml(const CalibrationFile& file);

/// Throws InputError, naming file, line and key, for invalid TOML, missing or unknown keys, and impossible numbers.
CalibrationFile read_calibration(const std::string& path);

}  // namespace tricoil::host
