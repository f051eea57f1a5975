#include "board/host/calibration/dense_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace tricoil::host {

SymmetricEigen eigen_of_symmetric(const Eigen::MatrixXd& a) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(a);
    return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd inverse_of_definite(const Eigen::MatrixXd& a) {
    return a.ldlt().solve(Eigen::MatrixXd::Identity(a.rows(), a.cols()));
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    constexpr double kRankTolerance =
        1e-10;  // rotations of a stage are read with five decimals: rounding must not look like rank
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(kRankTolerance);
    decomposition.compute(a);
    return decomposition.solve(b);
}

}  // namespace tricoil::host
