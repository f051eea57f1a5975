// Where a calibration starts from: fixtures and gains in closed form, from the data alone.
#pragma once

#include <string>
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
    double position_rms_m = 0;  // of the closed-form poses against the stage, with these
    double attitude_rms_rad = 0;
};

/// Transposes every stage rotation. Some stages count angles against the handedness of their own axes; no fixture and no wiring
/// can make up for that, so the sense that fits the couplings is the right one.
void turn_other_way(std::vector<PoseFile>& files);

/// For one source fixture. Gains from the couplings themselves (self_calibrate); poses from the direct solution; their
/// hemispheres from neighbours on the stage, and all of them together from the handedness of the fit; transforms by linear least
/// squares; the sense of the stage's rotations by which of both fits. Throws InputError if the poses do not determine them: too
/// few, without spread in all three directions, or left-handed couplings.
InitialGuess guess_start(const std::vector<PoseFile>& files);

}  // namespace tricoil::host
