// Fits the positions and sizes of all coils to couplings in unknown poses: three numbers per column frame are redundant.
#pragma once

#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "core/solver/refine.hpp"

namespace tricoil::host {

struct FreeMotionFit {
    CalibrationFit coils;                          // without fixtures and errors of a stage
    std::vector<solver::RigidPose<double>> poses;  // of the column frames
    std::vector<double> misfit_shares;             // of each column frame: share of the couplings that its pose does not explain
    std::size_t outliers = 0;
    double position_error_share = 0;  // estimated RMS error of positions due to errors of the coils, relative to the range
};

/// Levenberg-Marquardt (Ceres) over the magnetic parameters and the pose of every column frame (bundle adjustment; the poses are
/// eliminated by the Schur complement). Weights, robust loss and gauge are those of fit_calibration(). Free motion does not
/// determine the coupling constant: the result has `coupling_constant` (mean of the moments along the axes), and all lengths
/// follow from it. Every parameter has a weak prior at its ideal value; a warning names motion that determines the coils weakly.
/// hemisphere: half space of most positions, source frame; the others follow from the offsets of the coils. Throws
/// InputError like self_calibrate(), and for left-handed couplings and couplings that the model does not explain.
FreeMotionFit fit_free_motion(const std::vector<Mat3<double>>& frames, FitModel model, double coupling_constant,
                              const Vec3<double>& hemisphere, const ShowShare& progress = {});

/// The same coils with all lengths multiplied by `factor`: couplings at poses that are as many times farther are equal.
field::GeneralDipole<double> with_scaled_lengths(field::GeneralDipole<double> model, double factor);

/// The same, with the parameters.
CalibrationFit with_scaled_lengths(CalibrationFit fit, double factor);

}  // namespace tricoil::host
