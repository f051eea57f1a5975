// Solving with Ceres.
#pragma once

#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Core>

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

inline Eigen::MatrixXd dense(const ceres::CRSMatrix& sparse) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
    for (int row = 0; row < sparse.num_rows; ++row) {
        for (int at = sparse.rows[static_cast<std::size_t>(row)]; at < sparse.rows[static_cast<std::size_t>(row) + 1]; ++at) {
            matrix(row, sparse.cols[static_cast<std::size_t>(at)]) = sparse.values[static_cast<std::size_t>(at)];
        }
    }
    return matrix;
}

}  // namespace tricoil::host
