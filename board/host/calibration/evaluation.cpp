#include "board/host/calibration/evaluation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <cmath>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/geometry/angles.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

struct Found {
    solver::RigidPose<double> pose;
    bool converged = false;
    int iterations = 0;
    double misfit_share = 0;
};

const Rigid& fixture_of(const std::map<std::string, Rigid>& known, const std::string& name, const char* side,
                        const PoseFile& file) {
    const auto found = known.find(name);
    if (found == known.end()) {
        std::vector<std::string> names;
        for (const auto& [key, rigid] : known) {
            names.push_back(key);
        }
        throw InputError(
            fmt::format("{}: {} fixture '{}' is not in the calibration, which has: {}; use a file with one of these, or "
                        "--refit-fixtures",
                        file.path, side, name, fmt::join(names, ", ")));
    }
    return found->second;
}

/// Direction from the source to the middle of the true positions, per source fixture: another fixture turns the source.
std::map<std::string, Vec3<double>> hemispheres_of(const CalibrationFile& calibration, const std::vector<PoseFile>& files) {
    std::map<std::string, Vec3<double>> sums;
    for (const PoseFile& file : files) {
        const auto [source, mount] = fixtures_of(calibration, file);
        for (const MeasuredPose& pose : file.poses) {
            sums.try_emplace(source_fixture_name(file), Vec3<double>::Zero()).first->second +=
                true_pose(source, pose, mount).position_m.normalized();
        }
    }
    return sums;
}

Found solve_direct_pose(const calibration::Calibration<double>& c, const Mat3<double>& x, const std::string& place) {
    const auto solution = solver::solve_direct<double>(corrected(x, c.model.sensor_sensitivity, c.model.source_moment), 1.0);
    if (!solution.ok()) {
        throw InputError(place + ": " + solution.status().message());
    }
    return {{solution->position_towards(c.hemisphere), geometry::attitude_quaternion(solution->attitude)},
            solution->right_handed,
            0,
            std::sqrt(solution->misfit_squared / 1.5) / solution->strength};
}

Found solve_refined_pose(const calibration::Calibration<double>& c, const Mat3<double>& x, const std::string& place) {
    solver::ColdStartParams<double> params;
    params.hemisphere = c.hemisphere;
    params.refine.max_iterations = 40;
    const auto solution = solver::solve_cold<double>(c.model, x, Mat3<double>::Ones(), params);
    if (!solution.ok()) {
        throw InputError(place + ": " + solution.status().message());
    }
    const auto& r = solution->refinement;
    return {r.pose, r.converged() && solution->right_handed, solution->iterations, r.misfit_share};
}

/// Couplings that the stray field adds at a true pose.
Mat3<double> stray_couplings(const CalibrationFile& calibration, const solver::RigidPose<double>& truth) {
    const Mat3<double> o = truth.q_source_sensor.toRotationMatrix().transpose();
    return calibration.calibration.model.sensor_sensitivity.transpose() * o * calibration.stage_errors.stray;
}

}  // namespace

Fixtures fixtures_of(const CalibrationFile& calibration, const PoseFile& file) {
    return {fixture_of(calibration.source_stage, source_fixture_name(file), "source", file),
            fixture_of(calibration.mount_sensor, sensor_fixture_name(file), "sensor", file)};
}

std::vector<EvaluatedPose> evaluate(const CalibrationFile& calibration, const std::vector<PoseFile>& files,
                                    EvaluationSolver solver) {
    std::vector<PoseFile> turned = files;
    if (calibration.stage_turns_left_handed) {
        transpose_rotations(turned);
    }
    auto c = calibration.calibration;
    const auto hemispheres = hemispheres_of(calibration, turned);
    const auto output = calibration::CoilCorrection<double>::phases(c);
    std::vector<EvaluatedPose> errors;
    for (std::size_t f = 0; f < turned.size(); ++f) {
        const PoseFile& file = turned[f];
        const auto [source, mount] = fixtures_of(calibration, file);
        c.hemisphere = hemispheres.at(source_fixture_name(file));
        for (const MeasuredPose& pose : file.poses) {
            const std::string place = fmt::format("{}:{}", file.path, pose.line);
            const auto truth = true_pose(source, pose, mount, calibration.stage_errors);
            const Mat3<double> x = pose.x - stray_couplings(calibration, truth);
            const Found found =
                solver == EvaluationSolver::direct ? solve_direct_pose(c, x, place) : solve_refined_pose(c, x, place);
            EvaluatedPose error;
            error.file = f;
            error.line = pose.line;
            error.converged = found.converged;
            error.iterations = found.iterations;
            error.truth_m = truth.position_m;
            error.error_m = output.corrected_position(found.pose.position_m) - truth.position_m;
            error.rotation_error_rad =
                geometry::quaternion_to_rotation_vector<double>(found.pose.q_source_sensor * truth.q_source_sensor.conjugate());
            error.misfit_share = found.misfit_share;
            errors.push_back(error);
        }
    }
    return errors;
}

namespace {

/// One Gauss-Newton step that changes the transforms of all fixtures, and a free scale, so that the pose errors decrease.
void refine_fixtures(CalibrationFile& c, const std::vector<PoseFile>& files, const std::vector<EvaluatedPose>& errors) {
    std::map<std::string, Index> column;
    for (const PoseFile& file : files) {
        column.try_emplace("source " + source_fixture_name(file), 6 * static_cast<Index>(column.size()));
        column.try_emplace("mount " + sensor_fixture_name(file), 6 * static_cast<Index>(column.size()));
    }
    const auto scale = 6 * static_cast<Index>(column.size());  // last column
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6 * static_cast<Index>(errors.size()), scale + 1);
    Eigen::VectorXd residual(jacobian.rows());
    constexpr double kLever_m = 0.1;
    std::size_t at = 0;
    for (std::size_t f = 0; f < files.size(); ++f) {
        const Rigid& source = c.source_stage.at(source_fixture_name(files[f]));
        const Index s = column.at("source " + source_fixture_name(files[f]));
        const Index m = column.at("mount " + sensor_fixture_name(files[f]));
        for (const MeasuredPose& pose : files[f].poses) {
            const auto row = 6 * static_cast<Index>(at);
            const EvaluatedPose& e = errors[at++];
            const Mat3<double> turned = source.rotation * pose.stage_rotation;
            const Vec3<double> arm = e.truth_m - source.translation_m;
            // A small change (d, w) of source and mount moves the true pose by d_source + w_source x arm + A R d_mount and
            // rotates it by w_source + A R w_mount (A, R: rotations of source and stage).
            jacobian.block<3, 3>(row, s).setIdentity();
            jacobian.block<3, 3>(row, s + 3) = eigen(-geometry::skew<double>(arm));
            jacobian.block<3, 3>(row, m) = eigen(turned);
            jacobian.block<3, 3>(row + 3, s + 3) = kLever_m * Eigen::Matrix3d::Identity();
            jacobian.block<3, 3>(row + 3, m + 3) = kLever_m * eigen(turned);
            if (has_free_scale(c)) {
                jacobian.block<3, 1>(row, scale) = eigen(-(e.truth_m + e.error_m));
            }
            residual.segment<3>(row) = eigen(e.error_m);
            residual.segment<3>(row + 3) = kLever_m * eigen(e.rotation_error_rad);
        }
    }
    const Eigen::VectorXd step = least_squares(jacobian, residual);
    c.calibration.model = with_scaled_lengths(c.calibration.model, 1 + step(scale));
    const auto turn = [](const Vec3<double>& w, const Mat3<double>& r) -> Mat3<double> {
        return geometry::rotation_vector_to_quaternion<double>(w).toRotationMatrix() * r;
    };
    const auto move = [&](const std::string& kind, auto& fixtures) {
        for (auto& [name, rigid] : fixtures) {
            if (const auto found = column.find(kind + name); found != column.end()) {
                rigid.translation_m += Vec3<double>(step.segment<3>(found->second));
                rigid.rotation = nearest_rotation(turn(step.segment<3>(found->second + 3), rigid.rotation));
            }
        }
    };
    move("source ", c.source_stage);
    move("mount ", c.mount_sensor);
}

}  // namespace

CalibrationFile with_refitted_fixtures(const CalibrationFile& calibration, const std::vector<PoseFile>& files,
                                       EvaluationSolver solver) {
    CalibrationFile result = calibration;
    std::map<std::string, std::vector<PoseFile>> by_source;
    for (const PoseFile& file : files) {
        by_source[source_fixture_name(file)].push_back(file);
    }
    for (const auto& [name, group] : by_source) {
        const InitialGuess guess = guess_start(group);
        if (has_free_scale(result)) {
            auto& model = result.calibration.model;
            model = with_scaled_lengths(model, std::cbrt(3 * guess.coupling_constant / model.source_moment.trace()));
        }
        // The guess uses another gauge than the calibration, so it is used only for fixtures that the calibration lacks.
        if (result.source_stage.try_emplace(name, guess.source_stage).second) {
            result.stage_turns_left_handed = guess.stage_turns_left_handed;
        }
        for (std::size_t i = 0; i < group.size(); ++i) {
            result.mount_sensor.try_emplace(sensor_fixture_name(group[i]), guess.mount_sensor[i]);
        }
    }
    std::vector<PoseFile> turned = files;
    if (result.stage_turns_left_handed) {
        transpose_rotations(turned);
    }
    constexpr int kRounds = 5;
    for (int round = 0; round < kRounds; ++round) {
        refine_fixtures(result, turned, evaluate(result, files, solver));
    }
    return result;
}

}  // namespace tricoil::host
