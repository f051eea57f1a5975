#include "board/host/calibration/surroundings_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/fit_quality.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kTolerantMisfit = 0.3;  // share of the couplings that metal may explain before its dipoles are known

/// Pose from couplings that metal distorts: solve_cold() with equal weights, which accepts a misfit of 30 % of the couplings.
/// hemisphere: half space of the sensor. The result may be left-handed or not converged. Errors: as solve_cold().
Result<solver::ColdSolution<double>> solve_tolerant(const field::GeneralDipole<double>& model, const Mat3<double>& x,
                                                    const Vec3<double>& hemisphere) {
    solver::ColdStartParams<double> params;
    params.hemisphere = hemisphere;
    params.refine.max_iterations = 40;
    params.refine.max_misfit_share = kTolerantMisfit;
    return solver::solve_cold<double>(model, x, Mat3<double>::Ones(), params);
}

ModelErrors errors_of_model(const field::GeneralDipole<double>& model, const SurroundingsData& data,
                            const std::vector<solver::RigidPose<double>>& truths) {
    ModelErrors errors;
    double squares = 0;
    for (std::size_t k = 0; k < truths.size(); ++k) {
        const auto solution = solve_tolerant(model, data.poses[k].x, truths[k].position_m);
        if (!solution.ok() || !solution->refinement.converged()) {
            ++errors.not_converged;
            errors.error_m.push_back(std::numeric_limits<double>::infinity());
            continue;
        }
        const double error_m = (solution->refinement.pose.position_m - truths[k].position_m).norm();
        squares += error_m * error_m;
        errors.position_max_m = std::max(errors.position_max_m, error_m);
        errors.error_m.push_back(error_m);
        errors.misfit_max = std::max(errors.misfit_max, solution->refinement.misfit_share);
    }
    errors.position_rms_m =
        std::sqrt(squares / static_cast<double>(std::max<std::size_t>(truths.size() - errors.not_converged, 1)));
    return errors;
}

/// Index of a pose whose error is far above that of the others, or that has no solution.
std::optional<std::size_t> find_outlier(const ModelErrors& errors, const std::vector<solver::RigidPose<double>>& truths) {
    constexpr double kOfMedian = 20;
    constexpr double kOfRange = 0.01;
    const auto worst = std::max_element(errors.error_m.begin(), errors.error_m.end());
    const auto index = static_cast<std::size_t>(worst - errors.error_m.begin());
    const bool is_outlier = *worst > kOfMedian * median(errors.error_m) && *worst > kOfRange * truths[index].position_m.norm();
    return is_outlier ? std::optional(index) : std::nullopt;
}

/// Throws InputError for a pose that does not fit the others, and for dipoles that increase the error.
void refuse_bad_fit(const ModelErrors& without, const ModelErrors& with, const std::vector<solver::RigidPose<double>>& truths) {
    const std::size_t poses = truths.size();
    if (const auto pose = find_outlier(with, truths)) {
        const double error_m = with.error_m[*pose];
        throw InputError(fmt::format(
            "pose {} of {} does not fit the others: {}; its data are wrong, or metal is too near: correct or remove it",
            *pose + 1, poses,
            std::isinf(error_m)
                ? "its couplings give no pose"
                : fmt::format("{:.1f} mm of error, RMS of all {:.1f} mm", 1e3 * error_m, 1e3 * with.position_rms_m)));
    }
    refuse_if(with.not_converged > without.not_converged ||
                  (with.not_converged == without.not_converged && !(with.position_rms_m < without.position_rms_m)),
              "the virtual dipoles make the poses worse: {:.3f} mm RMS without them, {:.3f} mm with them, {} of {} poses without "
              "a solution; use the calibration without surroundings",
              1e3 * without.position_rms_m, 1e3 * with.position_rms_m, with.not_converged, poses);
}

}  // namespace

SurroundingsData data_at_known_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files) {
    correct_wiring(coils, files);
    SurroundingsData data;
    for_each_pose(coils, files, [&](std::size_t, const MeasuredPose& pose, const solver::RigidPose<double>& truth) {
        data.poses.push_back(
            {truth.position_m, truth.q_source_sensor.toRotationMatrix(), pose.x, pose.quadrature.value_or(Mat3<double>::Zero())});
    });
    return data;
}

SurroundingsData data_at_unknown_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files) {
    const std::string source_name = source_fixture_name(files.front());
    const std::string mount_name = sensor_fixture_name(files.front());
    for (const PoseFile& file : files) {
        refuse_if(source_fixture_name(file) != source_name || sensor_fixture_name(file) != mount_name,
                  "{}: has other fixtures than {}; --refit-fixtures takes files of one source and one sensor fixture", file.path,
                  files.front().path);
    }
    const CalibrationFile start = with_refitted_fixtures(coils, files, EvaluationSolver::refined);
    if (start.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    SurroundingsData data;
    data.fixtures_known = false;
    data.starts = {start.source_stage.at(source_name).rotation, start.mount_sensor.at(mount_name).rotation};
    data.frame = rigid_block(start.source_stage.at(source_name).translation_m);
    data.mount = rigid_block(start.mount_sensor.at(mount_name).translation_m);
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            data.poses.push_back({start.stage_errors.position_m(pose.stage_position_m, pose.stage_rotation), pose.stage_rotation,
                                  pose.x, pose.quadrature.value_or(Mat3<double>::Zero())});
        }
    }
    return data;
}

SurroundingsData data_on_grid(const CalibrationFile& coils, const std::vector<GridFrame>& frames, double spacing_m,
                              const Vec3<double>& hemisphere) {
    SurroundingsData data;
    data.fixtures_known = false;
    data.attitudes_known = false;
    Eigen::Matrix3Xd nodes(3, frames.size());
    Eigen::Matrix3Xd positions(3, frames.size());
    std::vector<Mat3<double>> attitudes;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto solution = solve_tolerant(coils.calibration.model, frames[k].x, hemisphere);
        if (!solution.ok() || !solution->right_handed) {
            throw InputError(frames[k].place + ": the couplings are left-handed or degenerate; correct the wiring");
        }
        nodes.col(static_cast<Index>(k)) = spacing_m * eigen(frames[k].node);
        positions.col(static_cast<Index>(k)) = eigen(solution->refinement.pose.position_m);
        attitudes.push_back(solution->refinement.pose.q_source_sensor.toRotationMatrix());
    }
    data.starts.frame = fit_similarity(nodes, positions).rotation;
    data.frame = rigid_block(positions.rowwise().mean() - eigen(data.starts.frame) * nodes.rowwise().mean());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        data.poses.push_back({nodes.col(static_cast<Index>(k)), data.starts.frame.transpose() * attitudes[k], frames[k].x,
                              frames[k].quadrature.value_or(Mat3<double>::Zero())});
    }
    return data;
}

SurroundingsCalibration add_surroundings(const CalibrationFile& coils, const SurroundingsFit& fit, const SurroundingsData& data) {
    SurroundingsCalibration calibrated{coils, errors_of_model(coils.calibration.model, data, fit.truths), {}};
    calibrated.file.calibration.quadrature_floor = 1;  // of the coils alone
    set_surroundings(calibrated.file, fit.dipoles, {fit.quadrature, fit.quadrature_deviation});
    calibrated.with = errors_of_model(calibrated.file.calibration.model, data, fit.truths);
    refuse_bad_fit(calibrated.without, calibrated.with, fit.truths);
    calibrated.file.calibration.misfit_floor = misfit_floor_of(calibrated.with.misfit_max);
    return calibrated;
}

}  // namespace tricoil::host
