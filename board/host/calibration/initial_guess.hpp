// Start values of a calibration: fixtures and gains in closed form from the data.
#pragma once

#include <span>
#include <vector>

#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/pose_set.hpp"

namespace tricoil::host {

struct InitialGuess {
    double coupling_constant = 1;                    // C of concentric triads with the gains below
    Mat3<double> sensor = Mat3<double>::Identity();  // gains and angles as in SelfCalibration
    Mat3<double> source = Mat3<double>::Identity();
    Rigid source_stage;
    std::vector<Rigid> mount_sensor;  // by file
    bool stage_turns_left_handed = false;
    double position_rms_m = 0;  // closed-form poses relative to the stage
    double attitude_rms_rad = 0;
};

/// Transposes every stage rotation. Some stages count angles opposite to the handedness of their axes. No fixture or wiring can
/// compensate this, so the sense that fits the couplings is correct.
void transpose_rotations(std::span<PoseFile> files);

/// Start values for files with one source fixture:
/// - gains from the couplings (self_calibrate), poses from the direct solution;
/// - relative hemispheres from neighbours on the stage, the common hemisphere from the handedness of the fit;
/// - transforms by linear least squares; the sense of the stage rotations that fits better.
/// Throws InputError if the poses do not determine them: fewer than 30, no spread in all
/// three directions, no rotation, or left-handed couplings.
InitialGuess guess_start(const std::vector<PoseFile>& files);

}  // namespace tricoil::host
