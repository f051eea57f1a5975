// Matrix decompositions of Eigen. No other source file has any, because each instantiation compiles slowly.
#pragma once

#include <Eigen/Core>

#include "core/linear/matrix.hpp"

namespace tricoil {

/// A = vectors diag(values) vectors^T, values in ascending order.
struct SymmetricEigen {
    Eigen::VectorXd values;
    Eigen::MatrixXd vectors;
};

/// Reads the lower triangle of `a`.
SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& a);

/// A v = value B v with symmetric A, positive definite B, and v^T B v = 1.
SymmetricEigen eigen_of_pair(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// A B v = value v with symmetric A, positive definite B, and v^T B v = 1.
SymmetricEigen eigen_of_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// L of a positive definite A = L L^T.
Eigen::MatrixXd lower_factor(const Eigen::MatrixXd& a);

/// Inverse of a positive definite matrix.
Eigen::MatrixXd inverse_of_definite(const Eigen::MatrixXd& a);

/// Solution X of A X = B with an invertible A.
Eigen::MatrixXcd solve(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

/// Moore-Penrose inverse; the rank is that of rounded numbers.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a);

/// Least-squares solution X of A X = B with minimum norm. Singular directions below 1e-10 of the largest count as zero.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Orthonormal basis of the vectors that are orthogonal to all columns of a matrix of full column rank.
Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& a);

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

}  // namespace tricoil
