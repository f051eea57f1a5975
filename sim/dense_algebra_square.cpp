#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "sim/dense_algebra.hpp"

namespace tricoil {

SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& a) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(a);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen eigen_of_pair(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(a, b);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen eigen_of_product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(a, b, Eigen::ABx_lx);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd lower_factor(const Eigen::MatrixXd& a) { return a.llt().matrixL(); }

Eigen::MatrixXd inverse_of_definite(const Eigen::MatrixXd& a) {
    return a.ldlt().solve(Eigen::MatrixXd::Identity(a.rows(), a.cols()));
}

Eigen::MatrixXcd solve(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) { return a.partialPivLu().solve(b); }

}  // namespace tricoil
