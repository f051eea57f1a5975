// Decompositions of matrices of run-time size. They are in one source file, because each instantiation compiles slowly.
#pragma once

#include <Eigen/Core>

namespace tricoil::host {

/// A = vectors diag(values) vectors^T, values in ascending order.
struct SymmetricEigen {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};

/// Reads the lower triangle of `a`.
SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& a);

/// Inverse of a positive definite matrix.
Eigen::MatrixXd inverse_of_definite(const Eigen::MatrixXd& a);

/// Least-squares solution X of A X = B with minimum norm.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace tricoil::host
