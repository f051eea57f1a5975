// Tip offset of a pointer from poses that turn about a fixed tip.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "board/support/json_text.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::host {

/// Valid pose of the sensor on the pointer.
struct PivotPose {
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q_source_sensor = Quat<double>::Identity();
    Mat6<double> covariance = Mat6<double>::Zero();  // position (m), then small rotation (rad), source frame
};

struct PivotCalibration {
    Vec3<double> tip_m = Vec3<double>::Zero();                // sensor frame
    Mat3<double> tip_covariance_m2 = Mat3<double>::Zero();    // enlarged by `inflation`
    Vec3<double> pivot_m = Vec3<double>::Zero();              // the fixed point, source frame
    Mat3<double> pivot_covariance_m2 = Mat3<double>::Zero();  //
    std::size_t outliers = 0;                                 // poses that were not used
    double residual_rms_m = 0;                                // 3D, of the used poses
    double residual_sigmas = 0;                               // the same per axis, relative to the poses' standard deviations
    double inflation = 1;                                     // factor of the covariance, relative to independent poses
    double tilt_deg = 0;                                      // RMS, of the sensor axis that tilts least
};

/// Weighted linear least squares in closed form, repeated with the weights and without the outliers of the previous result.
/// A rotation error r moves the tip t by r x (q t), so each weight depends on the tip. Errors of the attitudes would also shorten
/// the tip vector; the equations are corrected for this. `poses`: in order of time. Equal poses give equal results. If
/// all covariances are zero, they are taken from the residuals. Throws
/// InputError if the motion does not determine the tip: fewer than 10 poses, rotation about one axis, too little rotation, or a
/// tip that moves. `name`: of the poses, for messages.
PivotCalibration calibrate_pivot(std::vector<PivotPose> poses, const std::string& name);

struct PivotRecord {
    std::string name;  // for messages
    std::uint8_t sensor = 0;
    std::vector<PivotPose> poses;  // the valid ones, in the order of the file
    std::size_t invalid = 0;       // number of poses left out
};

/// Calibrates the tip and writes it to `out`, if not empty. The result has tip, pivot, standard deviations, residuals and
/// warnings. Throws like calibrate_pivot() and write_whole_file().
Json pivot_result(const PivotRecord& record, const std::string& out);

}  // namespace tricoil::host
