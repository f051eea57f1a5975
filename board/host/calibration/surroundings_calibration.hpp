// Calibration of coils and of the metal around them, with its errors.
#pragma once

#include <cstddef>
#include <vector>

#include "board/host/calibration/surroundings_data.hpp"

namespace tricoil::host {

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
