// Calibration by a user's hands: the sensor is turned in place and rested on the nodes of a printed grid of known spacing.
#pragma once

#include <vector>

#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/frame_file.hpp"

namespace tricoil::host {

struct GridCalibration {
    Mat3<double> sensor;                          // symmetric, trace three
    Mat3<double> source_moment;                   // symmetric, with the coupling constant
    Rigid source_grid;                            // grid to source components
    Vec3<double> pivot_m = Vec3<double>::Zero();  // from the point that rests on the node to the sensor's frame, sensor frame
    double position_rms_m = 0;                    // of the solved positions against the nodes
    double misfit_before = 0;                     // share of the couplings that no dipole explains
    double misfit_after = 0;
    double scale_deviation = 0;  // of the coupling constant, as share
};

/// Gains and angles as free motion gives them, the coupling constant from the grid's spacing; the pivot from frames in several
/// attitudes. hemisphere: half space (source frame) in which the grid lies; a grid cannot tell. Every attitude is free.
/// Throws InputError: fewer than 30 frames, nodes on one line, no spread of attitudes, positions that do not fit the grid.
GridCalibration calibrate_on_grid(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere);

}  // namespace tricoil::host
