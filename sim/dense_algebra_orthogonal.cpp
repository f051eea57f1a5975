#include <Eigen/QR>

#include "sim/dense_algebra.hpp"

namespace tricoil {

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a) {
    return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(a).pseudoInverse();
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    // Rotations of a stage are read with five decimals, so rounding must not increase the rank.
    constexpr double kRankTolerance = 1e-10;
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(kRankTolerance);
    decomposition.compute(a);
    return decomposition.solve(b);
}

Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& a) {
    const Eigen::MatrixXd q = a.householderQr().householderQ();
    return q.rightCols(a.rows() - a.cols());
}

}  // namespace tricoil
