#include "board/host/calibration/evaluation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "board/support/terminal_text.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/geometry/angles.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/judge/coil_errors.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "core/tracking/tracker_params.hpp"
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
    for_each_pose(calibration, files, [&](std::size_t f, const MeasuredPose&, const solver::RigidPose<double>& truth) {
        sums.try_emplace(source_fixture_name(files[f]), Vec3<double>::Zero()).first->second += truth.position_m.normalized();
    });
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
    params.refine.max_condition = 1e9;  // the errors of weakly determined poses belong to the evaluation
    const auto solution = solver::solve_cold<double>(c.model, x, Mat3<double>::Ones(), params);
    if (!solution.ok()) {
        throw InputError(place + ": " + solution.status().message());
    }
    const auto& r = solution->refinement;
    return {r.pose, r.converged() && solution->right_handed, solution->iterations, r.misfit_share};
}

}  // namespace

Fixtures fixtures_of(const CalibrationFile& calibration, const PoseFile& file) {
    return {fixture_of(calibration.source_stage, source_fixture_name(file), "source", file),
            fixture_of(calibration.mount_sensor, sensor_fixture_name(file), "sensor", file)};
}

void for_each_pose(const CalibrationFile& calibration, std::vector<PoseFile> files,
                   const std::function<void(std::size_t, const MeasuredPose&, const solver::RigidPose<double>&)>& use) {
    if (calibration.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    for (std::size_t f = 0; f < files.size(); ++f) {
        const auto [source, mount] = fixtures_of(calibration, files[f]);
        for (const MeasuredPose& pose : files[f].poses) {
            use(f, pose, true_pose(source, pose, mount, calibration.stage_errors));
        }
    }
}

void correct_wiring(const CalibrationFile& calibration, std::vector<PoseFile>& files) {
    constexpr double kCertain = 0.9;
    using Correlation = std::array<Mat3<double>, 2>;  // as read, transposed
    std::vector<Correlation> correlations(files.size(), {Mat3<double>::Zero(), Mat3<double>::Zero()});
    for_each_pose(calibration, files, [&](std::size_t f, const MeasuredPose& pose, const solver::RigidPose<double>& truth) {
        const Mat3<double> model = couplings_at(calibration.calibration.model, calibration.stage_errors, truth);
        const double scale = 1 / (model.norm() * pose.x.norm() * static_cast<double>(files[f].poses.size()));
        correlations[f][0] += scale * model.cwiseProduct(pose.x);
        correlations[f][1] += scale * model.cwiseProduct(pose.x.transpose());
    });
    for (std::size_t f = 0; f < files.size(); ++f) {
        FileWiring found;
        double most = std::max(correlations[f][0].sum(), kCertain);
        for (int k = 1; k < 128; ++k) {
            const auto sign = [k](int bit) { return (k >> bit & 1) != 0 ? -1.0 : 1.0; };
            const FileWiring wiring{sign(6) < 0, {sign(0), sign(1), sign(2)}, {sign(3), sign(4), sign(5)}};
            const double sum = wiring.sensor.dot(correlations[f][wiring.transposed ? 1 : 0] * wiring.source);
            if (sum > most + 1e-9) {
                most = sum;
                found = wiring;
            }
        }
        found.count_fewest();
        found.correct(files[f]);
        if (found.differs()) {
            refuse_if(!calibration.calibration.pick_up.is_none(),
                      "{}: {}; pick-up needs the wiring of the calibration: correct the file", files[f].path, found.text());
            print_notice("tricoil: {}: unlike the calibration: {}; corrected\n", files[f].path, found.text());
        }
    }
}

void state_deviations(const calibration::Calibration<double>& calibration, std::vector<EvaluatedPose>& errors) {
    tracking::CommonParams<double> params;
    params.misfit_floor = calibration.misfit_floor;
    params.floor_share = calibration.errors.floor_share;
    params.pick_up_sigma = calibration.pick_up.sigma;
    for (EvaluatedPose& error : errors) {
        const double floor = tracking::floor_variance(params, error.strength);
        const double misfit = 1.5 * error.misfit_share * error.misfit_share * error.strength * error.strength;
        const bool significant = floor > 0 && misfit > params.distortion_gate * params.calibration_variance(error.strength);
        const double hidden = significant ? tracking::kHiddenShare * tracking::kHiddenShare * misfit / 3 : 0;
        const double range_m = error.solved_m.norm();
        const Mat6<double> unit = solver::pose_covariance<double>(error.strength, range_m, error.solved_m / range_m, 1);
        const Mat6<double> of_coils = tracking::covariance_of_coil_errors(calibration.errors, error.solved_m);
        error.of_floor = (floor * unit).topLeftCorner<3, 3>();
        error.of_others = (hidden * unit + of_coils).topLeftCorner<3, 3>();
        if (const Mat3<double> stated = error.of_floor + error.of_others; stated.trace() > 0) {
            error.deviation_m = std::sqrt(stated.trace());
            error.sigmas = std::sqrt(error.error_m.dot(stated.inverse() * error.error_m));
        }
    }
}

std::vector<EvaluatedPose> evaluate(const CalibrationFile& calibration, const std::vector<PoseFile>& files,
                                    EvaluationSolver solver, const std::function<void()>& on_pose) {
    auto c = calibration.calibration;
    const auto hemispheres = hemispheres_of(calibration, files);
    const auto output = calibration::CoilCorrection<double>::phases(c);
    std::vector<EvaluatedPose> errors;
    for_each_pose(calibration, files, [&](std::size_t f, const MeasuredPose& pose, const solver::RigidPose<double>& truth) {
        if (on_pose) {
            on_pose();
        }
        c.hemisphere = hemispheres.at(source_fixture_name(files[f]));
        const std::string place = fmt::format("{}:{}", files[f].path, pose.line);
        const Mat3<double> expected = couplings_at(c.model, calibration.stage_errors, truth);
        const Mat3<double> x = pose.x - (expected - couplings_at(c.model, {}, truth));  // without the stray field
        const Found found = solver == EvaluationSolver::direct ? solve_direct_pose(c, x, place) : solve_refined_pose(c, x, place);
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
        error.strength = x.norm() / std::sqrt(1.5);
        error.solved_m = found.pose.position_m;
        if (const auto& metal = c.surroundings_lag.dipoles; pose.quadrature && !pose.quadrature->isZero(0) && !metal.empty()) {
            const Mat3<double> lag = field::induced_couplings<double>(c.model, metal, truth.position_m,
                                                                      truth.q_source_sensor.toRotationMatrix().transpose());
            error.surroundings_change = lag.cwiseProduct(*pose.quadrature).sum() / lag.squaredNorm() - 1;
        }
        error.unexplained_share = std::min((expected - pose.x).norm() / pose.x.norm(), 1.0);
        errors.push_back(error);
    });
    state_deviations(c, errors);
    return errors;
}

namespace {

/// One Gauss-Newton step that changes the transforms of all fixtures, and a free scale, so that the errors of the poses that
/// converged decrease.
void refine_fixtures(CalibrationFile& c, const std::vector<PoseFile>& files, const std::vector<EvaluatedPose>& errors) {
    std::map<std::string, Index> column;
    for (const PoseFile& file : files) {
        column.try_emplace("source " + source_fixture_name(file), 6 * static_cast<Index>(column.size()));
        column.try_emplace("mount " + sensor_fixture_name(file), 6 * static_cast<Index>(column.size()));
    }
    const auto scale = 6 * static_cast<Index>(column.size());  // last column
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6 * static_cast<Index>(errors.size()), scale + 1);
    Eigen::VectorXd residual = Eigen::VectorXd::Zero(jacobian.rows());
    constexpr double kLever_m = 0.1;
    std::size_t at = 0;
    for (std::size_t f = 0; f < files.size(); ++f) {
        const Rigid& source = c.source_stage.at(source_fixture_name(files[f]));
        const Index s = column.at("source " + source_fixture_name(files[f]));
        const Index m = column.at("mount " + sensor_fixture_name(files[f]));
        for (const MeasuredPose& pose : files[f].poses) {
            const auto row = 6 * static_cast<Index>(at);
            const EvaluatedPose& e = errors[at++];
            if (!e.converged) {
                continue;
            }
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

CalibrationFile with_refitted_fixtures(const CalibrationFile& calibration, std::vector<PoseFile>& files, EvaluationSolver solver,
                                       const std::function<void()>& on_pose) {
    CalibrationFile result = calibration;
    bool sense_known = false;
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
        const Vec3<double> signs =
            reversed_coils(result.calibration.model, model_of(guess.magnetic.data(), guess.coupling_constant));
        const Rigid source{signs.asDiagonal() * guess.source_stage.rotation,
                           signs.asDiagonal() * guess.source_stage.translation_m};
        if (result.source_stage.try_emplace(name, source).second) {
            refuse_if(sense_known && result.stage_turns_left_handed != guess.stage_turns_left_handed,
                      "{}: the stage turns in the opposite direction to that in the other files; evaluate them separately",
                      group[0].path);
            sense_known = true;
            result.stage_turns_left_handed = guess.stage_turns_left_handed;
        }
        for (std::size_t i = 0; i < group.size(); ++i) {
            result.mount_sensor.try_emplace(sensor_fixture_name(group[i]), guess.mount_sensor[i]);
        }
    }
    correct_wiring(result, files);
    std::vector<PoseFile> turned = files;
    if (result.stage_turns_left_handed) {
        transpose_rotations(turned);
    }
    constexpr int kRounds = 5;
    for (int round = 0; round < kRounds; ++round) {
        refine_fixtures(result, turned, evaluate(result, files, solver, on_pose));
    }
    return result;
}

}  // namespace tricoil::host
