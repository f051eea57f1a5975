// Result of a solver of Ceres.
#pragma once

#include <ceres/solver.h>

#include "board/support/errors.hpp"

namespace tricoil::host {

/// Throws InputError if the solution cannot be used.
inline void refuse_unusable(const ceres::Solver::Summary& summary) {
    if (!summary.IsSolutionUsable()) {
        throw InputError("the calibration does not converge: " + summary.message);
    }
}

}  // namespace tricoil::host
