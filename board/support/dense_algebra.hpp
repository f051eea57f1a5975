// Decompositions of matrices. They are in one source file, because each instantiation compiles slowly.
#pragma once

#include <Eigen/Core>

#include "core/linear/matrix.hpp"

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

/// In descending order.
Eigen::VectorXd singular_values(const Eigen::MatrixXd& a);

/// Rotation nearest to a finite matrix in the Frobenius norm (Schoenemann 1966; sign as in Kabsch 1978).
Mat3<double> nearest_rotation(const Mat3<double>& m);

/// to = scale rotation from + translation.
struct Similarity {
    double scale = 1;
    Mat3<double> rotation;
    Vec3<double> translation;
};

/// Least-squares fit to corresponding columns (Umeyama 1991).
Similarity fit_similarity(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

}  // namespace tricoil::host
