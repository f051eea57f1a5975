// Calibration of coils and of the metal around them, from poses on a stage or from a printed grid, with its errors.
#pragma once

#include <cstddef>
#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/surroundings_fit.hpp"

namespace tricoil::host {

/// Poses on the stage of the calibration. Throws InputError for fixtures that the calibration lacks.
SurroundingsData data_at_known_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Poses on a stage at unknown places of source and sensor on it. Throws InputError for files with several fixtures, and like
/// with_refitted_fixtures.
SurroundingsData data_at_unknown_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Nodes of a printed grid in any attitudes. hemisphere: half space of the grid. Throws InputError for couplings without a pose.
SurroundingsData data_on_grid(const CalibrationFile& coils, const std::vector<GridFrame>& frames, double spacing_m,
                              const Vec3<double>& hemisphere);

/// Errors of the poses that a model gives for the couplings.
struct ModelErrors {
    double position_rms_m = 0;
    double position_max_m = 0;
    double misfit_max = 0;          // largest share of the couplings that no pose explains
    std::size_t not_converged = 0;  // not in the figures above
    std::vector<double> error_m;    // by pose; infinite without convergence
};

struct SurroundingsCalibration {
    CalibrationFile file;
    ModelErrors without;  // of the coils alone, at the poses of the fit
    ModelErrors with;     // of coils and dipoles
};

/// Adds the dipoles of a fit to coils that are calibrated without surroundings. The misfit that remains becomes the misfit floor;
/// the quadrature floor becomes unknown. fit: of the same coils and data. Throws InputError for a pose that does not fit the
/// others, and for dipoles that increase the error.
SurroundingsCalibration add_surroundings(const CalibrationFile& coils, const SurroundingsFit& fit, const SurroundingsData& data);

}  // namespace tricoil::host
