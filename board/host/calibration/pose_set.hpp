// Couplings at poses that a stage knows: what a calibration is fitted to and an evaluation measures against.
#pragma once

#include <string>
#include <vector>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// One line of a file. The stage carries the sensor's mount: v_stage = stage_position_m + stage_rotation v_mount.
struct MeasuredPose {
    Vec3<double> stage_position_m;
    Mat3<double> stage_rotation;
    Mat3<double> x;        // couplings; x(i, j): sensor coil i, source coil j
    std::size_t line = 0;  // in the file, from 1
};

/// One recording: source and sensor stay in their fixtures, only the stage moves.
struct PoseFile {
    std::string path;
    std::string source_fixture;  // as the file's name says, "YoutZup" for soYoutZup_...; empty if it does not
    std::string sensor_fixture;
    std::vector<MeasuredPose> poses;
    Vec3<double> phase_rad = Vec3<double>::Zero();  // of each sensor channel, where the format has complex couplings
};

/// Reads either format. Throws InputError, naming file and line.
/// - ILEMT text: x y z (mm) and Euler angles Rx Ry Rz (deg; rotation Rz Ry Rx) of the stage, then nine complex couplings as
///   +0.1-0.2i, (source 1, sensor 1), (source 2, sensor 1), ..., and optionally nine more of a second carrier, which are checked
///   and left. The real coupling is the magnitude with the sign of the real part.
/// - CSV with the header x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33 (xij: sensor coil i, source coil j).
PoseFile read_pose_file(const std::string& path);

/// All files; throws InputError also if one is named twice.
std::vector<PoseFile> read_pose_files(const std::vector<std::string>& paths);

std::size_t count_poses(const std::vector<PoseFile>& files);

}  // namespace tricoil::host
