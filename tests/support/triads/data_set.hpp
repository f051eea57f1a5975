// Simulated stage recording with wound triads: couplings at known stage poses, as ILEMT text.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/triads/wound_coil.hpp"

namespace tricoil::sim {

/// Two wound triads, each in its own coordinate frame.
struct RealTriads {
    std::array<WoundCoilParams, 3> source;
    std::array<WoundCoilParams, 3> sensor;
    double coupling_constant = 2e-3;  // C: coupling units times m^3 for axes of unit length
};

/// Source coils on the corners of a triangle, `spacing_m` from each other; sensor coils off centre by 1 mm RMS per axis. Axes are
/// turned by `skew_deg` about random axes, gains are 0.95 to 1.05. source_radius_m: of the source windings; sensor windings have
/// 3 mm.
RealTriads make_triads(double spacing_m, double skew_deg, double source_radius_m, std::uint64_t seed);

/// X(i, j) for the sensor at position_m (source frame) with attitude o (source to sensor components).
Mat3<double> coupling_matrix(const RealTriads& triads, const Vec3<double>& position_m, const Mat3<double>& o);

/// A stage with three axes and a turntable about its z; source and sensor mounted with small angle errors.
struct StageParams {
    double distance_m = 0.25;  // from the source to the centre of the workspace
    double half_width_m = 0.05;
    int steps = 3;  // per axis
    std::vector<double> turns_deg{-90, -45, 0, 45, 90};
    double position_sigma_m = 0;                          // of the stage
    Mat3<double> turning = Mat3<double>::Zero();          // a stage at t with rotation R stands at t + R turning R^T t
    double noise_share = 0;                               // relative to the largest coupling of a pose
    Mat3<double> source_turn = Mat3<double>::Identity();  // of the source in another fixture
    std::uint64_t seed = 1;
};

/// Text of one file for a sensor fixture (0: YoutZup, 1: ZinXdown, 2: ZinYup).
std::string ilemt_text(const RealTriads& triads, const StageParams& stage, int sensor_fixture);

/// File name such as soYoutZup_seZinYup_md.dat.
std::string ilemt_name(int sensor_fixture, const std::string& suffix);

}  // namespace tricoil::sim
