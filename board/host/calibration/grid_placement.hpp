// Scale of all lengths from poses of a sensor on the nodes of a printed grid.
#pragma once

#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/support/calibration_file.hpp"
#include "core/solver/refine.hpp"

namespace tricoil::host {

struct GridPlacement {
    double scale = 1;                   // the true positions are the given ones times this
    Rigid source_grid;                  // grid to source components
    std::vector<Vec3<double>> pivot_m;  // by file: vector from the node to the sensor, sensor frame
    std::vector<double> distances_m;    // scaled positions from their nodes, by column frame
};

constexpr double kHandError_m = 3e-3;  // scale of the robust loss; a hand places the sensor with about this error

/// Least squares with a robust loss. poses: one for each column frame, with lengths in any unit.
GridPlacement place_on_grid(const std::vector<GridFrame>& frames, const std::vector<solver::RigidPose<double>>& poses,
                            double spacing_m);

}  // namespace tricoil::host
