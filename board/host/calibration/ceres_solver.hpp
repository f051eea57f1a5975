// Solving with Ceres.
#pragma once

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "board/support/errors.hpp"

namespace tricoil::host {

/// Throws InputError if the solution cannot be used.
inline void refuse_unusable(const ceres::Solver::Summary& summary) {
    if (!summary.IsSolutionUsable()) {
        throw InputError("the calibration does not converge: " + summary.message);
    }
}

/// Solves a problem with few parameters. Throws InputError if the solution cannot be used.
inline void solve_dense(ceres::Problem& problem) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 100;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    refuse_unusable(summary);
}

}  // namespace tricoil::host
