#include "board/host/calibration/self_calibration.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <cmath>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_parameters.hpp"
#include "board/support/errors.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/direct.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMinFrames = 30;
constexpr int kShape = 5;              // parameters of one triad: symmetric matrix with trace three
constexpr double kWeakest = 1e-4;      // smallest accepted ratio of singular values of the Jacobian
constexpr double kRobustShare = 0.02;  // scale of the robust loss, relative misfit

using Shape = Eigen::Matrix<double, kShape, 1>;

/// misfit_of() is smooth in X, also where two singular values are equal.
struct MisfitFunctor {
    Mat3<double> x;

    bool operator()(const double* sensor, const double* source, double* residual) const {
        const auto ideal = corrected(x, sensitivity_matrix(sensor), sensitivity_matrix(source));
        const auto s = solver::solve_direct<double>(ideal, 1.0);
        if (!s.ok()) {
            return false;
        }
        copy_rows(misfit_of(ideal, *s), residual);
        return true;
    }
};

struct Spread {
    double misfit = 0;
    Vec3<double> ratios = Vec3<double>::Zero();
    Vec3<double> deviation = Vec3<double>::Zero();
};

Spread spread_of(const std::vector<Mat3<double>>& frames, const Mat3<double>& sensor, const Mat3<double>& source) {
    Spread spread;
    Vec3<double> sum = Vec3<double>::Zero();
    Eigen::Array2d mean = Eigen::Array2d::Zero();
    Eigen::Array2d squares = Eigen::Array2d::Zero();
    for (const Mat3<double>& frame : frames) {
        const Vec3<double> s = singular_values(eigen(corrected(frame, sensor, source)));
        sum += s / s.norm();
        const Eigen::Array2d ratio(s(0) / (s(1) + s(2)), s(1) / s(2));
        mean += ratio;
        squares += ratio.square();
        const double a = s(0) - s(1) - s(2);
        const double b = s(1) - s(2);
        spread.misfit += (a * a / 3 + b * b / 2) / s.squaredNorm();
    }
    const auto n = static_cast<double>(frames.size());
    mean /= n;
    spread.misfit = std::sqrt(spread.misfit / n);
    spread.ratios = sum / sum(2);
    const Eigen::Array2d deviation = (squares / n - mean.square()).max(0.0).sqrt();
    spread.deviation << deviation(0), deviation(1), spread.misfit;
    return spread;
}

Mat3<double> entries_of(const Eigen::VectorXd& d, double last) { return symmetric_matrix(d(0), d(1), last, d(2), d(3), d(4)); }

/// Sets `weakest` and the standard deviations: from the Jacobian at the solution and the variance of the residuals.
void estimate_deviations(ceres::Problem& problem, std::vector<double*> blocks, SelfCalibration& result) {
    ceres::Problem::EvaluateOptions options;
    options.parameter_blocks = std::move(blocks);
    ceres::CRSMatrix sparse;
    double cost = 0;
    problem.Evaluate(options, &cost, nullptr, nullptr, &sparse);
    const Eigen::MatrixXd jacobian = dense(sparse);
    const Eigen::Matrix<double, 2 * kShape, 2 * kShape> information = jacobian.transpose() * jacobian;
    const SymmetricEigen eigen = eigen_of_symmetric(information);
    result.weakest = std::sqrt(std::max(0.0, eigen.values(0)) / eigen.values(2 * kShape - 1));
    refuse_if(result.weakest < kWeakest,
              "free motion did not determine all gains and angles: turn the sensor through all attitudes and move it around the "
              "source");
    const double frames = sparse.num_rows / 9.0;
    const double variance = 2 * cost / (3 * frames - 2 * kShape);  // three residual degrees of freedom per frame
    const Eigen::Matrix<double, 2 * kShape, 2 * kShape> covariance = variance * inverse_of_definite(information);
    const auto last = [&](int first) { return std::sqrt(covariance.block<2, 2>(first, first).sum()); };
    const Eigen::VectorXd deviation = covariance.diagonal().cwiseSqrt();
    result.sensor_deviation = entries_of(deviation.head<kShape>(), last(0));
    result.source_deviation = entries_of(deviation.tail<kShape>(), last(kShape));
}

}  // namespace

SelfCalibration self_calibrate(const std::vector<Mat3<double>>& frames) {
    refuse_if(frames.size() < kMinFrames, "{} column frames are too few to calibrate from free motion; at least {} are needed",
              frames.size(), kMinFrames);
    Shape sensor;
    sensor << 1, 1, 0, 0, 0;
    Shape source = sensor;
    ceres::Problem problem;
    for (const Mat3<double>& frame : frames) {
        problem.AddResidualBlock(
            new ceres::NumericDiffCostFunction<MisfitFunctor, ceres::CENTRAL, 9, kShape, kShape>(new MisfitFunctor{frame}),
            new ceres::CauchyLoss(kRobustShare), sensor.data(), source.data());
    }
    ceres::Solver::Options options = silent_options(ceres::DENSE_NORMAL_CHOLESKY, 60);
    options.function_tolerance = 1e-12;
    const auto summary = summary_of(problem, options);
    SelfCalibration result;
    result.converged = summary.IsSolutionUsable() && summary.termination_type == ceres::CONVERGENCE;
    result.sensor = sensitivity_matrix(sensor.data());
    result.source = sensitivity_matrix(source.data());
    estimate_deviations(problem, {sensor.data(), source.data()}, result);
    const Spread before = spread_of(frames, Mat3<double>::Identity(), Mat3<double>::Identity());
    const Spread after = spread_of(frames, result.sensor, result.source);
    result.misfit_before = before.misfit;
    result.misfit_after = after.misfit;
    result.ratios_before = before.ratios;
    result.ratios_after = after.ratios;
    result.spread_before = before.deviation;
    result.spread_after = after.deviation;
    return result;
}

}  // namespace tricoil::host
