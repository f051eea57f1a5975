// Summary of pose errors as table and picture.
#pragma once

#include <string>
#include <vector>

#include "board/host/calibration/evaluation.hpp"
#include "board/support/statistics.hpp"

namespace tricoil::host {

struct ErrorBand {
    double from_m = 0;
    double to_m = 0;
    std::size_t poses = 0;
    ErrorSummary position_m;
    ErrorSummary orientation_deg;
};

struct ErrorReport {
    ErrorBand all;
    std::vector<ErrorBand> bands;  // of 50 mm of range
    std::size_t not_converged = 0;
    int iterations_max = 0;
    double misfit_share_max = 0;
    Vec3<double> axis_rms_m = Vec3<double>::Zero();  // along the source frame's axes
    // Position error, split by least squares: a cubic polynomial of the position (surroundings, field shape, stage), the
    // remaining part that depends on the attitude within each file (sensor shape, fixture), and the rest (repeatability of the
    // stage, noise).
    double smooth_rms_m = 0;
    double attitude_rms_m = 0;
    double rough_rms_m = 0;
};

/// Places FILE:LINE of the poses without a solution; empty if there are none.
std::string places_not_converged(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files);

/// Errors of the poses that converged as one band.
ErrorBand error_band(const std::vector<EvaluatedPose>& errors, double from_m = 0, double to_m = 0);

ErrorReport summarise_errors(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files);

/// One line per pose: file, line, true position and error (mm), rotation error (deg), misfit, iterations, convergence.
std::string error_csv(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files);

}  // namespace tricoil::host
