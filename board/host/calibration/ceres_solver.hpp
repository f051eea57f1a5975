// Solving with Ceres.
#pragma once

#include <ceres/problem.h>
#include <ceres/solver.h>

#include "board/support/errors.hpp"

namespace tricoil::host {

/// Options of a solver that prints nothing. DENSE_QR: for few parameters.
inline ceres::Solver::Options silent_options(ceres::LinearSolverType solver = ceres::DENSE_QR, int iterations = 100) {
    ceres::Solver::Options options;
    options.linear_solver_type = solver;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = iterations;
    return options;
}

inline ceres::Solver::Summary summary_of(ceres::Problem& problem, const ceres::Solver::Options& options) {
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return summary;
}

/// Throws InputError if the solution cannot be used.
inline void solve_usably(ceres::Problem& problem, const ceres::Solver::Options& options = silent_options()) {
    if (const auto summary = summary_of(problem, options); !summary.IsSolutionUsable()) {
        throw InputError("the calibration does not converge: " + summary.message);
    }
}

}  // namespace tricoil::host
