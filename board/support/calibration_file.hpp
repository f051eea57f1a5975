// Calibration and its fixtures as TOML.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/calibration/calibration.hpp"

namespace tricoil::host {

/// v_to = translation_m + rotation v_from.
struct Rigid {
    Mat3<double> rotation = Mat3<double>::Identity();
    Vec3<double> translation_m = Vec3<double>::Zero();
};

// Errors of the stage that gives the true poses, and of the room around it, are not part of the tracker.

/// A stage at position t with rotation R stands at t + (R turning R^T + room) t. All zero: an ideal stage.
struct StageErrors {
    Mat3<double> turning =
        Mat3<double>::Zero();                  // linear in the position as it is in the turning frame: sag, guides not straight
    Mat3<double> room = Mat3<double>::Zero();  // linear in the position in the stage's frame: scales and angles of its axes
    Mat3<double> stray =
        Mat3<double>::Zero();  // uniform field of the surroundings, source frame, coupling units: column per coil

    [[nodiscard]] bool is_ideal() const { return turning.isZero(0) && room.isZero(0) && stray.isZero(0); }
    [[nodiscard]] Vec3<double> position_m(const Vec3<double>& stage_m, const Mat3<double>& rotation) const {
        return stage_m + rotation * (turning * (rotation.transpose() * stage_m)) + room * stage_m;
    }
};

/// Metal at rest relative to the source, as one dipole (field::induced_dipole).
struct VirtualDipole {
    Vec3<double> position_m = Vec3<double>::Zero();         // source frame
    Mat3<double> polarisability_m3 = Mat3<double>::Zero();  // symmetric
};

/// Virtual dipoles of the quadratures, not at the same places, and calibration::SurroundingsLag::deviation. No dipoles: unknown.
struct SurroundingsQuadrature {
    std::vector<VirtualDipole> dipoles;
    double deviation = 0;
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
    SurroundingsQuadrature quadrature;        // likewise; not in the flash blob
};

/// Free motion without a known coupling constant leaves the scale of all lengths open.
inline bool has_free_scale(const CalibrationFile& file) { return file.model == kFreeMotionModel; }

/// Moments that the source coils induce.
field::InducedDipoles<double> induced_by(const field::GeneralDipole<double>& coils, const std::vector<VirtualDipole>& dipoles);

/// Sets the virtual dipoles, also those of the tracker: moments that the source coils of the file induce.
void set_surroundings(CalibrationFile& file, std::vector<VirtualDipole> surroundings, SurroundingsQuadrature quadrature = {});

std::string to_toml(const CalibrationFile& file);

/// Throws InputError, naming file, line and key, for invalid TOML, missing or unknown keys, and impossible numbers.
CalibrationFile read_calibration(const std::string& path);
/// For a tracker. Prints a notice if the file does not state its own errors.
calibration::Calibration<double> read_coils(const std::string& path);

}  // namespace tricoil::host
