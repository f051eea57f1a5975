#include "board/host/calibration/grid_calibration.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/calibration/pose_residual.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kHandError_m = 3e-3;  // scale of the robust loss; a hand places the sensor with about this error
constexpr double kLeastMisfit = 1e-4;  // of real couplings, for the weight of their misfit
constexpr double kWorstFit = 0.1;      // RMS position error relative to the grid's extent; a larger one is refused

using PivotBlock = std::array<double, 3>;  // vector from the node to the sensor, sensor frame, units of 0.1 m

/// p - (t + R node) - A pivot. p, A: position and attitude of the sensor; `node_m` is turned by the start rotation of the grid.
Vec3<double> off_node(const Vec3<double>& position_m, const Mat3<double>& attitude, const Vec3<double>& node_m,
                      const double* grid, const double* pivot) {
    return position_m - length_of(grid) - rotation_of(grid + 3) * node_m - attitude * length_of(pivot);
}

/// Coils of which only the scale of all lengths is not known.
struct ScaleResidual {
    static constexpr int kRows = 3;
    Vec3<double> node_m;
    Vec3<double> position_m;
    Mat3<double> attitude;

    bool operator()(const double* scale, const double* grid, const double* pivot, double* residual) const {
        copy_rows(off_node(*scale * position_m, attitude, node_m, grid, pivot), residual);
        return true;
    }
};

/// Ideal triads: their gains and angles, and the coupling constant in units of its start value. Three rows of the position, nine
/// of the misfit.
struct TriadsResidual {
    static constexpr int kRows = 12;
    Vec3<double> node_m;
    Mat3<double> x;
    double coupling_constant;
    Vec3<double> hemisphere;
    double lever_m;  // position error with the same weight as a misfit of 100 %

    bool operator()(const double* sensor, const double* moment, const double* grid, const double* pivot, double* residual) const {
        const Mat3<double> ideal = corrected(x, sensitivity_matrix(sensor), coupling_constant * symmetric_matrix(moment));
        const auto s = solver::solve_direct<double>(ideal, 1.0);
        if (!s.ok()) {
            return false;
        }
        copy_rows(off_node(s->position_towards(hemisphere), s->attitude.transpose(), node_m, grid, pivot), residual);
        copy_rows(lever_m * misfit_of(ideal, *s), residual + 3);
        return true;
    }
};

/// Least squares with a robust loss over the place of the grid, the pivots, and further parameters.
class GridAdjustment {
public:
    /// positions_m: of the column frames, with lengths in any unit.
    GridAdjustment(const std::vector<GridFrame>& frames, double spacing_m, const Eigen::Matrix3Xd& positions_m)
        : frames_(frames), nodes_m_(3, frames.size()) {
        for (std::size_t k = 0; k < frames.size(); ++k) {
            nodes_m_.col(static_cast<Index>(k)) = spacing_m * eigen(frames[k].node);
            pivots_.resize(std::max(pivots_.size(), frames[k].file + 1));
        }
        start_ = fit_similarity(nodes_m_, positions_m);
        grid_ = rigid_block(start_.translation / start_.scale);
    }

    /// The true positions are those of the start values divided by this.
    [[nodiscard]] double start_scale() const { return start_.scale; }
    /// Node of a column frame, turned by the start rotation.
    [[nodiscard]] Vec3<double> node_m(std::size_t k) const {
        return Vec3<double>(eigen(start_.rotation) * nodes_m_.col(static_cast<Index>(k)));
    }

    /// `blocks`: the parameters of the residual before grid and pivot, of these sizes.
    template <int... Sizes, typename Residual>
    void add(std::size_t k, const Residual& residual, auto... blocks) {
        problem_.AddResidualBlock(
            new ceres::NumericDiffCostFunction<Residual, ceres::CENTRAL, Residual::kRows, Sizes..., kRigid, 3>(
                new Residual(residual)),
            new ceres::CauchyLoss(kHandError_m), blocks..., grid_.data(), pivots_[frames_[k].file].data());
    }

    /// Residuals at the solution, without the loss; sets the place of the grid, pivots and distances.
    std::vector<double> solve(GridCalibration& result) {
        solve_usably(problem_);
        std::vector<double> residuals;
        ceres::Problem::EvaluateOptions evaluate;
        evaluate.apply_loss_function = false;
        problem_.Evaluate(evaluate, nullptr, &residuals, nullptr, nullptr);
        const std::size_t rows = residuals.size() / frames_.size();
        for (std::size_t at = 0; at < residuals.size(); at += rows) {
            result.distances_m.push_back(Vec3<double>(residuals.data() + at).norm());
        }
        result.source_grid = rigid_of(grid_, start_.rotation);
        for (const PivotBlock& pivot : pivots_) {
            result.pivot_m.push_back(length_of(pivot.data()));
        }
        return residuals;
    }

private:
    const std::vector<GridFrame>& frames_;
    Eigen::Matrix3Xd nodes_m_;
    Similarity start_;
    RigidBlock grid_{};  // relative to the start rotation
    std::vector<PivotBlock> pivots_;
    ceres::Problem problem_;
};

/// RMS distance of the nodes from their middle, in steps. Throws InputError for nodes on one line.
double extent_of(const std::vector<GridFrame>& frames) {
    Eigen::Matrix3Xd nodes(3, frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        nodes.col(static_cast<Index>(k)) = eigen(frames[k].node);
    }
    const Vec3<double> extent = extents(nodes);
    refuse_if(extent(1) < 0.05 * extent(0) || !(extent(0) > 0),
              "the grid's nodes lie on one line; place the sensor on nodes of several rows and columns");
    return extent.norm() / std::sqrt(static_cast<double>(nodes.cols()));
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
    result.coils.errors.coupling_constant = std::min(result.scale_deviation, calibration::CoilErrors<double>::kMostOfConstant);
    if (!(result.position_rms_m <= kWorstFit * extent_m)) {
        const auto farthest = std::max_element(result.distances_m.begin(), result.distances_m.end());
        throw InputError(fmt::format(
            "the positions differ from the grid by {:.1f} mm RMS, most at {} ({:.1f} mm): nodes and couplings do not belong "
            "together, the grid is on another side of the source than --hemisphere says, or it crosses the plane of the source",
            1e3 * result.position_rms_m, frames[static_cast<std::size_t>(farthest - result.distances_m.begin())].place,
            1e3 * *farthest));
    }
}

GridCalibration coils_with_positions(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere,
                                     FitModel model) {
    const auto couplings = in_phase_of(frames);
    FreeMotionFit motion = fit_free_motion(couplings, model, 1, hemisphere);
    Eigen::Matrix3Xd positions(3, frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        positions.col(static_cast<Index>(k)) = eigen(motion.poses[k].position_m);
    }
    GridAdjustment grid(frames, spacing_m, positions);
    double scale = 1 / grid.start_scale();
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto& pose = motion.poses[k];
        grid.add<1>(k, ScaleResidual{grid.node_m(k), pose.position_m, pose.q_source_sensor.toRotationMatrix()}, &scale);
    }
    GridCalibration result;
    (void)grid.solve(result);
    result.misfit_before = self_calibrate(couplings).misfit_before;
    result.misfit_after = motion.coils.residual_rms;
    result.misfit_floor = misfit_floor_of(motion.misfit_shares, motion.outliers);
    result.coils = with_scaled_lengths(std::move(motion.coils), scale);
    result.position_error_share = motion.position_error_share;
    result.outliers = motion.outliers;
    return result;
}

GridCalibration ideal_triads(const std::vector<GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere) {
    const SelfCalibration gains = self_calibrate(in_phase_of(frames));
    Eigen::Matrix3Xd positions(3, frames.size());  // computed with C = 1
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto s = solver::solve_direct<double>(corrected(frames[k].x, gains.sensor, gains.source), 1.0);
        if (!s.ok() || !s->right_handed) {
            throw InputError(frames[k].place + ": the couplings are left-handed or degenerate; correct the wiring");
        }
        positions.col(static_cast<Index>(k)) = eigen(s->position_towards(hemisphere));
    }
    GridAdjustment grid(frames, spacing_m, positions);
    const double c = 1 / std::pow(grid.start_scale(), 3);
    auto magnetic = parameters_of(gains.source, gains.sensor);  // moments in units of the start value of C
    double* const moment = magnetic.data();
    double* const sensor = magnetic.data() + kSensitivities;
    const double lever_m = kHandError_m / std::max(gains.misfit_after, kLeastMisfit);
    for (std::size_t k = 0; k < frames.size(); ++k) {
        grid.add<5, 6>(k, TriadsResidual{grid.node_m(k), frames[k].x, c, hemisphere, lever_m}, sensor, moment);
    }
    GridCalibration result;
    double misfit = 0;
    const std::vector<double> residuals = grid.solve(result);
    for (std::size_t at = 0; at < residuals.size(); at += TriadsResidual::kRows) {
        misfit += Matrix<double, 9, 1>(residuals.data() + at + 3).squaredNorm();
    }
    result.misfit_before = gains.misfit_before;
    result.misfit_after = std::sqrt(misfit / static_cast<double>(frames.size()) / 1.5) / lever_m;
    result.coils.errors.couplings = gains.coupling_error();
    result.coils.model.sensor_sensitivity = sensitivity_matrix(sensor);
    result.coils.model.source_moment = c * symmetric_matrix(moment);
    return result;
}

}  // namespace

void check_spacing(double spacing_m) {
    refuse_if(!(spacing_m >= 1e-3 && spacing_m <= 1), "--spacing-mm must be between 1 and 1000; got {}", 1e3 * spacing_m);
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
