// Calibration by hand: the user rotates the sensor and places it on nodes of a printed grid of known spacing.
#pragma once

#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/frame_file.hpp"

namespace tricoil::host {

struct GridCalibration {
    CalibrationFit coils;               // parameters only with positions of the coils
    Rigid source_grid;                  // grid to source components
    std::vector<Vec3<double>> pivot_m;  // by file: vector from the node to the sensor, sensor frame
    std::vector<double> distances_m;    // solved positions from their nodes, by column frame
    double position_rms_m = 0;          // RMS of these
    double misfit_before = 0;           // share of the couplings that no pose explains, of ideal triads
    double misfit_after = 0;            // of these coils
    double misfit_floor = 0;            // for the distortion test; only with positions of the coils
    double scale_deviation = 0;         // relative standard deviation of the coupling constant
    double position_error_share = 0;    // as of FreeMotionFit; only with positions of the coils
    std::size_t outliers = 0;           // column frames; only with positions of the coils
};

/// Throws InputError for a spacing outside 1 mm to 1 m.
void check_spacing(double spacing_m);

/// Estimates the coils as from free motion, the coupling constant from the grid's spacing, and the pivot of each file from column
/// frames in several attitudes. The attitudes need not be known. Ideal triads (concentric) are fitted to nodes and couplings
/// together; positions and sizes of coils first to the couplings, then the scale to the nodes. hemisphere: half space (source
/// frame) of the grid, which the couplings do not determine. Throws InputError for fewer than 30 column frames, nodes on one
/// line, no spread of attitudes, left-handed couplings, or positions that do not fit the grid.
GridCalibration calibrate_on_grid(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere,
                                  FitModel model = FitModel::concentric);

}  // namespace tricoil::host
