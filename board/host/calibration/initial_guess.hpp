// Start values of a calibration: fixtures and gains in closed form from the data.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/pose_set.hpp"

namespace tricoil::host {

struct InitialGuess {
    double coupling_constant = 1;              // unit of the moments
    std::array<double, kMagnetic> magnetic{};  // without octupoles
    Rigid source_stage;
    std::vector<Rigid> mount_sensor;  // by file
    std::vector<FileWiring> wiring;   // by file; everything else holds for corrected couplings
    bool stage_turns_left_handed = false;
    bool left_handed_couplings = false;  // of all files: one coil, or all three of a side, is reversed, or two are swapped
    double position_rms_m = 0;           // position errors that the unexplained couplings would cause
};

/// Transposes every stage rotation. Some stages count angles opposite to the handedness of their axes. No fixture or wiring can
/// compensate this, so the sense that fits the couplings is correct.
void transpose_rotations(std::span<PoseFile> files);

/// Start values for files with one source fixture, for coils at any distance from each other: places by search,
/// then sensitivities and moments as the dominant singular vectors of their products, which also have the
/// sign of each coil. The sense of the stage rotations, and the order of the couplings (by sensor or by source coil), are those
/// that fit better. Throws InputError if the poses do not determine them: fewer than 30, no spread in all three directions, or no
/// rotation.
InitialGuess guess_start(const std::vector<PoseFile>& files);

/// -1 for each source coil that is reversed in `found` relative to `known`: two reversed coils turn the frame of the source by
/// 180 deg about the third. Concentric coils do not show it. Only ratios of the moments count.
Vec3<double> reversed_coils(const field::GeneralDipole<double>& known, const field::GeneralDipole<double>& found);

}  // namespace tricoil::host
