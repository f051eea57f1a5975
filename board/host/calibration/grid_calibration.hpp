// Calibration by hand: the user rotates the sensor and places it on nodes of a printed grid of known spacing.
#pragma once

#include <vector>

#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/frame_file.hpp"

namespace tricoil::host {

struct GridCalibration {
    Mat3<double> sensor;                          // sensitivities: symmetric, trace three
    Mat3<double> source_moment;                   // symmetric, includes the coupling constant
    Rigid source_grid;                            // grid to source components
    Vec3<double> pivot_m = Vec3<double>::Zero();  // vector from the node to the sensor, sensor frame
    double position_rms_m = 0;                    // solved positions relative to the nodes
    double misfit_before = 0;                     // share of the couplings that no dipole explains
    double misfit_after = 0;
    double scale_deviation = 0;  // relative standard deviation of the coupling constant
};

/// Estimates gains and angles as from free motion, the coupling constant from the grid's spacing, and the pivot from column
/// frames in several attitudes. The attitudes need not be known. hemisphere: half space (source frame) of the grid, which the
/// couplings do not determine. Throws InputError for fewer than 30 column frames, nodes on one line, no spread of attitudes,
/// left-handed couplings, or positions that do not fit the grid.
GridCalibration calibrate_on_grid(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere);

}  // namespace tricoil::host
