#include <unsupported/Eigen/NonLinearOptimization>

#include "core/linear/eigen.hpp"
#include "tests/bench/iterative_solvers.hpp"

namespace tricoil::bench {
namespace {

struct Functor {
    const Problem& problem;

    static int values() { return 9; }
    int operator()(const Eigen::VectorXd& d, Eigen::VectorXd& residuals) const {
        residuals = eigen(problem.residuals(d));
        return 0;
    }
    int df(const Eigen::VectorXd& d, Eigen::MatrixXd& jacobian) const {
        jacobian = eigen(problem.jacobian(d));
        return 0;
    }
};

}  // namespace

SolvedPose solve_levenberg_marquardt(const Problem& problem) {
    Functor functor{problem};
    Eigen::LevenbergMarquardt<Functor> solver(functor);
    Eigen::VectorXd d = Eigen::VectorXd::Zero(6);
    solver.minimize(d);
    return problem.at(d);
}

}  // namespace tricoil::bench
