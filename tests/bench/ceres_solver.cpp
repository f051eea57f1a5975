#include <ceres/ceres.h>

#include "tests/bench/iterative_solvers.hpp"

namespace tricoil::bench {
namespace {

class CostFunction final : public ceres::SizedCostFunction<9, 6> {
public:
    explicit CostFunction(const Problem& problem) : problem_(problem) {}

    bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
        const Vec6<double> d = Vec6<double>(parameters[0]);
        copy_rows(problem_.residuals(d), residuals);
        if (jacobians != nullptr && jacobians[0] != nullptr) {
            copy_rows(problem_.jacobian(d), jacobians[0]);
        }
        return true;
    }

private:
    const Problem& problem_;
};

}  // namespace

SolvedPose solve_ceres(const Problem& problem) {
    Vec6<double> d = Vec6<double>::Zero();
    ceres::Problem ceres_problem;
    ceres_problem.AddResidualBlock(new CostFunction(problem), nullptr, d.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 1e-12;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    return problem.at(d);
}

}  // namespace tricoil::bench
