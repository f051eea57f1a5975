#include "board/host/calibration/surroundings_data.hpp"

#include <fmt/format.h>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kTolerantMisfit = 0.3;  // share of the couplings that metal may explain before its dipoles are known

void set_block(RigidBlock& block, const Vec3<double>& translation_m) {
    block = {};
    copy_rows(translation_m / kLengthUnit_m, block.data());
}

}  // namespace

Result<solver::ColdSolution<double>> solve_tolerant(const field::GeneralDipole<double>& model, const Mat3<double>& x,
                                                    const Vec3<double>& hemisphere) {
    solver::ColdStartParams<double> params;
    params.hemisphere = hemisphere;
    params.refine.max_iterations = 40;
    params.refine.max_misfit_share = kTolerantMisfit;
    return solver::solve_cold<double>(model, x, Mat3<double>::Ones(), params);
}

SurroundingsData data_at_known_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files) {
    if (coils.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    SurroundingsData data;
    for (const PoseFile& file : files) {
        const auto source = coils.source_stage.find(source_fixture_name(file));
        const auto mount = coils.mount_sensor.find(sensor_fixture_name(file));
        if (source == coils.source_stage.end() || mount == coils.mount_sensor.end()) {
            const bool is_source = source == coils.source_stage.end();
            throw InputError(fmt::format("{}: {} fixture '{}' is not in the calibration; use --refit-fixtures", file.path,
                                         is_source ? "source" : "sensor",
                                         is_source ? source_fixture_name(file) : sensor_fixture_name(file)));
        }
        for (const MeasuredPose& pose : file.poses) {
            const auto truth = true_pose(source->second, pose, mount->second, coils.stage_errors);
            data.poses.push_back({truth.position_m, truth.q_source_sensor.toRotationMatrix(), pose.x});
        }
    }
    return data;
}

SurroundingsData data_at_unknown_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files) {
    const std::string source_name = source_fixture_name(files.front());
    const std::string mount_name = sensor_fixture_name(files.front());
    for (const PoseFile& file : files) {
        if (source_fixture_name(file) != source_name || sensor_fixture_name(file) != mount_name) {
            throw InputError(file.path + ": has other fixtures than " + files.front().path +
                             "; --refit-fixtures takes files of one source and one sensor fixture");
        }
    }
    const CalibrationFile start = with_refitted_fixtures(coils, files, EvaluationSolver::refined);
    if (start.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    SurroundingsData data;
    data.fixtures_known = false;
    data.starts = {start.source_stage.at(source_name).rotation, start.mount_sensor.at(mount_name).rotation};
    set_block(data.frame, start.source_stage.at(source_name).translation_m);
    set_block(data.mount, start.mount_sensor.at(mount_name).translation_m);
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            data.poses.push_back(
                {start.stage_errors.position_m(pose.stage_position_m, pose.stage_rotation), pose.stage_rotation, pose.x});
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
    set_block(data.frame, positions.rowwise().mean() - eigen(data.starts.frame) * nodes.rowwise().mean());
    for (std::size_t k = 0; k < frames.size(); ++k) {
        data.poses.push_back({nodes.col(static_cast<Index>(k)), data.starts.frame.transpose() * attitudes[k], frames[k].x});
    }
    return data;
}

}  // namespace tricoil::host
