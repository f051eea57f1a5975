// Decompositions of matrices of run-time size. Compiled once: each takes the compiler seconds wherever it is instantiated.
#pragma once

#include <Eigen/Core>

namespace tricoil::host {

/// A = vectors diag(values) vectors^T; values in rising order.
struct SymmetricEigen {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};

/// Reads the lower triangle of `a`.
SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& a);

/// Inverse of a positive definite matrix.
Eigen::MatrixXd inverse_of_definite(const Eigen::MatrixXd& a);

/// X of least norm that minimises |A X - B|.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace tricoil::host
