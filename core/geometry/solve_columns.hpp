// Solutions of small linear systems with several right-hand sides.
#pragma once

#include <Eigen/Cholesky>

namespace tricoil {

/// A^-1 B of a Cholesky factorisation (or L^-1 B of its matrixL()), column by column: a single column is unrolled, several at
/// once go through Eigen's blocked solution for run-time sizes, which names malloc and is slower.
template <typename Factorisation, typename Rhs>
Eigen::Matrix<typename Rhs::Scalar, Rhs::RowsAtCompileTime, Rhs::ColsAtCompileTime> solve_columns(
    const Factorisation& factorisation, const Eigen::MatrixBase<Rhs>& b) {
    using Column = Eigen::Matrix<typename Rhs::Scalar, Rhs::RowsAtCompileTime, 1>;
    Eigen::Matrix<typename Rhs::Scalar, Rhs::RowsAtCompileTime, Rhs::ColsAtCompileTime> solution;
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
        const Column column = b.col(j);
        solution.col(j) = Column(factorisation.solve(column));
    }
    return solution;
}

}  // namespace tricoil
