#include "board/host/calibration/grid_calibration.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/grid_placement.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/direct.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kMisfitLever_m = 0.02;  // position error with the same weight as a misfit of 100 %
constexpr double kWorstFit = 0.1;        // RMS position error relative to the grid's extent; a larger one is refused

struct Parameters {
    std::array<double, 5> sensor{1, 1, 0, 0, 0};
    std::array<double, 6> moment{1, 1, 1, 0, 0, 0};  // in units of the start value of C
    std::array<double, 6> grid{};                    // translation (0.1 m), rotation vector relative to the start value
    std::vector<std::array<double, 3>> pivot;        // by file, 0.1 m
};

struct NodeResidual {
    Vec3<double> node_m;
    Mat3<double> x;
    Mat3<double> grid_start;
    double coupling_constant;
    Vec3<double> hemisphere;

    bool operator()(const double* n, const double* m, const double* grid, const double* pivot, double* residual) const {
        const Mat3<double> sensor = symmetric_matrix(n[0], n[1], 3 - n[0] - n[1], n[2], n[3], n[4]);
        const Mat3<double> moment = coupling_constant * symmetric_matrix(m[0], m[1], m[2], m[3], m[4], m[5]);
        const Mat3<double> ideal = corrected(x, sensor, moment);
        const auto s = solver::solve_direct<double>(ideal, 1.0);
        if (!s.ok()) {
            return false;
        }
        const double side = s->direction.dot(hemisphere) < 0 ? -1 : 1;
        const Vec3<double> position = side * s->range_m * s->direction;
        Mat3<double> turn;
        ceres::AngleAxisToRotationMatrix(grid + 3, turn.data());
        const Vec3<double> node = kLengthUnit_m * Vec3<double>(grid[0], grid[1], grid[2]) + turn * grid_start * node_m;
        const Vec3<double> arm = s->attitude.transpose() * (kLengthUnit_m * Vec3<double>(pivot[0], pivot[1], pivot[2]));
        copy_rows(position - node - arm, residual);
        copy_rows(kMisfitLever_m * (ideal / s->strength - s->attitude * field::dipole_factor<double>(s->direction)),
                  residual + 3);
        return true;
    }
};

/// RMS distance of the nodes from their middle, in steps. Throws InputError for nodes on one line.
double extent_of(const std::vector<GridFrame>& frames) {
    Eigen::Matrix3Xd nodes(3, frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        nodes.col(static_cast<Index>(k)) = eigen(frames[k].node);
    }
    nodes.colwise() -= nodes.rowwise().mean().eval();
    const Vec3<double> extent = singular_values(nodes);
    if (extent(1) < 0.05 * extent(0) || !(extent(0) > 0)) {
        throw InputError("the grid's nodes lie on one line; place the sensor on nodes of several rows and columns");
    }
    return std::sqrt(nodes.squaredNorm() / static_cast<double>(nodes.cols()));
}

GridCalibration result_of(const Parameters& p, double c, const Similarity& start, const std::vector<double>& residuals,
                          std::size_t frames, double misfit_before) {
    GridCalibration result;
    result.coils.model.sensor_sensitivity =
        symmetric_matrix(p.sensor[0], p.sensor[1], 3 - p.sensor[0] - p.sensor[1], p.sensor[2], p.sensor[3], p.sensor[4]);
    result.coils.model.source_moment =
        c * symmetric_matrix(p.moment[0], p.moment[1], p.moment[2], p.moment[3], p.moment[4], p.moment[5]);
    Mat3<double> turn;
    ceres::AngleAxisToRotationMatrix(p.grid.data() + 3, turn.data());
    result.source_grid = {turn * start.rotation, kLengthUnit_m * Vec3<double>(p.grid[0], p.grid[1], p.grid[2])};
    for (const auto& pivot : p.pivot) {
        result.pivot_m.push_back(kLengthUnit_m * Vec3<double>(pivot[0], pivot[1], pivot[2]));
    }
    double misfit = 0;
    for (std::size_t at = 0; at < residuals.size(); at += 12) {
        result.distances_m.push_back(Vec3<double>(residuals.data() + at).norm());
        misfit += Matrix<double, 9, 1>(residuals.data() + at + 3).squaredNorm();
    }
    const auto count = static_cast<double>(frames);
    result.misfit_before = misfit_before;
    result.misfit_after = std::sqrt(misfit / count / 1.5) / kMisfitLever_m;
    return result;
}

/// Sets RMS and standard deviation of the scale. Throws InputError if the positions do not fit the grid.
void check_distances(const std::vector<GridFrame>& frames, double extent_m, GridCalibration& result) {
    double squares = 0;
    for (const double distance_m : result.distances_m) {
        squares += distance_m * distance_m;
    }
    const auto count = static_cast<double>(frames.size());
    result.position_rms_m = std::sqrt(squares / count);
    result.scale_deviation = 3 * std::hypot(result.position_rms_m / (extent_m * std::sqrt(count)), result.position_error_share);
    if (!(result.position_rms_m <= kWorstFit * extent_m)) {
        const auto farthest = std::max_element(result.distances_m.begin(), result.distances_m.end());
        throw InputError(fmt::format(
            "the positions differ from the grid by {:.1f} mm RMS, most at {} ({:.1f} mm): nodes and couplings do not belong "
            "together, the grid is on another side of the source than --hemisphere says, or it crosses the plane of the source",
            1e3 * result.position_rms_m, frames[static_cast<std::size_t>(farthest - result.distances_m.begin())].place,
            1e3 * *farthest));
    }
}

std::vector<Mat3<double>> couplings_of(const std::vector<GridFrame>& frames) {
    std::vector<Mat3<double>> couplings;
    for (const GridFrame& frame : frames) {
        couplings.push_back(frame.x);
    }
    return couplings;
}

GridCalibration coils_with_positions(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere,
                                     FitModel model) {
    const auto couplings = couplings_of(frames);
    FreeMotionFit motion = fit_free_motion(couplings, model, 1, hemisphere);
    const GridPlacement placement = place_on_grid(frames, motion.poses, spacing_m);
    GridCalibration result;
    result.misfit_before = self_calibrate(couplings).misfit_before;
    result.misfit_after = motion.coils.residual_rms;
    result.misfit_floor = misfit_floor_of(motion.misfit_shares, motion.outliers);
    result.coils = with_scaled_lengths(std::move(motion.coils), placement.scale);
    result.source_grid = placement.source_grid;
    result.pivot_m = placement.pivot_m;
    result.distances_m = placement.distances_m;
    result.position_error_share = motion.position_error_share;
    result.outliers = motion.outliers;
    return result;
}

GridCalibration ideal_triads(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere) {
    const auto couplings = couplings_of(frames);
    const SelfCalibration gains = self_calibrate(couplings);
    Eigen::Matrix3Xd nodes(3, frames.size());
    Eigen::Matrix3Xd positions(3, frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto s = solver::solve_direct<double>(corrected(frames[k].x, gains.sensor, gains.source), 1.0);
        if (!s.ok() || !s->right_handed) {
            throw InputError(frames[k].place + ": the couplings are left-handed or degenerate; correct the wiring");
        }
        const double side = s->direction.dot(hemisphere) < 0 ? -1 : 1;
        nodes.col(static_cast<Index>(k)) = spacing_m * eigen(frames[k].node);
        positions.col(static_cast<Index>(k)) = side * s->range_m * eigen(s->direction);
    }
    const Similarity start = fit_similarity(nodes, positions);  // positions computed with C = 1
    const double c = 1 / std::pow(start.scale, 3);
    Parameters p;
    const Mat3<double>& n = gains.sensor;
    const Mat3<double>& m = gains.source;
    p.sensor = {n(0, 0), n(1, 1), n(0, 1), n(0, 2), n(1, 2)};
    p.moment = {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
    for (std::size_t k = 0; k < 3; ++k) {
        p.grid[k] = start.translation(static_cast<Index>(k)) / start.scale / kLengthUnit_m;
    }
    for (const GridFrame& frame : frames) {
        p.pivot.resize(std::max(p.pivot.size(), frame.file + 1));
    }
    ceres::Problem problem;
    for (const GridFrame& frame : frames) {
        problem.AddResidualBlock(new ceres::NumericDiffCostFunction<NodeResidual, ceres::CENTRAL, 12, 5, 6, 6, 3>(
                                     new NodeResidual{spacing_m * frame.node, frame.x, start.rotation, c, hemisphere}),
                                 new ceres::CauchyLoss(kHandError_m), p.sensor.data(), p.moment.data(), p.grid.data(),
                                 p.pivot[frame.file].data());
    }
    solve_usably(problem);
    std::vector<double> residuals;
    ceres::Problem::EvaluateOptions evaluate;
    evaluate.apply_loss_function = false;
    problem.Evaluate(evaluate, nullptr, &residuals, nullptr, nullptr);
    return result_of(p, c, start, residuals, frames.size(), gains.misfit_before);
}

}  // namespace

void check_spacing(double spacing_m) {
    if (!(spacing_m >= 1e-3 && spacing_m <= 1)) {
        throw InputError(fmt::format("--spacing-mm must be between 1 and 1000; got {}", 1e3 * spacing_m));
    }
}

GridCalibration calibrate_on_grid(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere,
                                  FitModel model) {
    check_spacing(spacing_m);
    const double extent_m = spacing_m * extent_of(frames);
    GridCalibration result = model == FitModel::concentric ? ideal_triads(frames, spacing_m, hemisphere)
                                                           : coils_with_positions(frames, spacing_m, hemisphere, model);
    check_distances(frames, extent_m, result);
    return result;
}

}  // namespace tricoil::host
