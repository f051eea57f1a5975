#include "board/host/calibration/initial_guess.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/direct.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMinPoses = 30;  // the gains need as many, see self_calibrate()
constexpr double kMinSpread = 0.02;    // ratio of the smallest to the largest principal extent of the stage positions

/// Measured pose and its direct solution.
struct Solved {
    const MeasuredPose* pose;
    std::size_t file;
    Vec3<double> position_m;  // computed with C = 1
    Mat3<double> attitude;    // O
    double weight = 1;
};

using PoseList = std::vector<std::pair<const MeasuredPose*, std::size_t>>;

PoseList all_poses(const std::vector<PoseFile>& files) {
    PoseList list;
    for (std::size_t f = 0; f < files.size(); ++f) {
        for (const MeasuredPose& pose : files[f].poses) {
            list.emplace_back(&pose, f);
        }
    }
    return list;
}

void check_spread(const PoseList& list) {
    refuse_if(list.size() < kMinPoses, "{} poses are too few to calibrate; at least {} are needed, spread over the workspace",
              list.size(), kMinPoses);
    Eigen::Matrix3Xd positions(3, list.size());
    for (std::size_t i = 0; i < list.size(); ++i) {
        positions.col(static_cast<Index>(i)) = eigen(list[i].first->stage_position_m);
    }
    const Vec3<double> extent = extents(positions);
    refuse_if(extent(2) < kMinSpread * extent(0),
              "the stage's positions lie in one plane or on one line; calibration needs poses spread in all three directions");
    Mat3<double> mean = Mat3<double>::Zero();
    for (const auto& [pose, file] : list) {
        mean += pose->stage_rotation / static_cast<double>(list.size());
    }
    refuse_if(singular_values(eigen(mean))(2) > 0.999,
              "the stage does not rotate; calibration needs poses in different attitudes (20 degrees and more)");
}

std::vector<Solved> solve_all(const PoseList& list, const std::vector<PoseFile>& files, const InitialGuess& guess) {
    std::vector<Solved> solved;
    std::size_t left_handed = 0;
    for (const auto& [pose, file] : list) {
        const Mat3<double> x = corrected(pose->x, guess.sensor, guess.source);
        const auto solution = solver::solve_direct<double>(x, 1.0);
        if (!solution.ok()) {
            throw InputError(fmt::format("{}:{}: {}", files[file].path, pose->line, solution.status().message()));
        }
        left_handed += solution->right_handed ? 0U : 1U;
        solved.push_back({pose, file, solution->range_m * solution->direction, solution->attitude});
    }
    refuse_if(2 * left_handed > list.size(),
              "the couplings are left-handed (det X < 0): one coil, or all three of one side, is reversed, or two are swapped; "
              "correct the wiring or the signs");
    return solved;
}

/// Chooses the signs of the positions: poses that are close on the stage must be close in the source frame. Follows a minimum
/// spanning tree of the distances on the stage.
void align_hemispheres(std::vector<Solved>& solved) {
    const std::size_t n = solved.size();
    std::vector<double> distance(n, std::numeric_limits<double>::max());
    std::vector<std::size_t> parent(n, 0);
    std::vector<bool> done(n, false);
    distance[0] = 0;
    for (std::size_t step = 0; step < n; ++step) {
        std::size_t next = n;
        for (std::size_t i = 0; i < n; ++i) {
            if (!done[i] && (next == n || distance[i] < distance[next])) {
                next = i;
            }
        }
        done[next] = true;
        if (step > 0 && solved[next].position_m.dot(solved[parent[next]].position_m) < 0) {
            solved[next].position_m *= -1;
        }
        for (std::size_t i = 0; i < n; ++i) {
            // A rotation of the stage also moves the sensor in its mount: a radian counts as 0.1 m.
            const double turn = (solved[i].pose->stage_rotation - solved[next].pose->stage_rotation).norm() / std::sqrt(2.0);
            const double other_file = solved[i].file == solved[next].file ? 0 : 0.05;
            const double d =
                (solved[i].pose->stage_position_m - solved[next].pose->stage_position_m).norm() + 0.1 * turn + other_file;
            if (!done[i] && d < distance[i]) {
                distance[i] = d;
                parent[i] = next;
            }
        }
    }
}

/// G of p = G t + H_f vec(R) + c by least squares. p: position with C = 1; t, R: stage; H_f: 3 x 9 matrix of each file.
Mat3<double> linear_part(const std::vector<Solved>& solved, std::size_t files) {
    const auto n = static_cast<Index>(solved.size());
    Eigen::MatrixXd features = Eigen::MatrixXd::Zero(n, 4 + 9 * static_cast<Index>(files));
    Eigen::MatrixXd positions(n, 3);
    for (Index i = 0; i < n; ++i) {
        const Solved& s = solved[static_cast<std::size_t>(i)];
        features.row(i).head<3>() = s.weight * eigen(s.pose->stage_position_m);
        features(i, 3) = s.weight;
        features.row(i).segment<9>(4 + 9 * static_cast<Index>(s.file)) = s.weight * eigen(s.pose->stage_rotation).reshaped();
        positions.row(i) = s.weight * eigen(s.position_m);
    }
    const Eigen::MatrixXd solution = least_squares(features, positions);
    return solution.topRows<3>().transpose();
}

/// c and the offset d of each file's mount from p / s - A t = A R d + c by least squares. s: scale; A: rotation of the stage.
void fit_offsets(const std::vector<Solved>& solved, double scale, InitialGuess& guess) {
    const auto n = static_cast<Index>(solved.size());
    const auto unknowns = 3 + 3 * static_cast<Index>(guess.mount_sensor.size());
    Eigen::MatrixXd features = Eigen::MatrixXd::Zero(3 * n, unknowns);
    Eigen::VectorXd rest(3 * n);
    const Mat3<double>& a = guess.source_stage.rotation;
    for (Index i = 0; i < n; ++i) {
        const Solved& s = solved[static_cast<std::size_t>(i)];
        features.block<3, 3>(3 * i, 0) = s.weight * Eigen::Matrix3d::Identity();
        features.block<3, 3>(3 * i, 3 + 3 * static_cast<Index>(s.file)) = eigen(s.weight * a * s.pose->stage_rotation);
        rest.segment<3>(3 * i) = eigen(s.weight * (s.position_m / scale - a * s.pose->stage_position_m));
    }
    const Eigen::VectorXd solution = least_squares(features, rest);
    guess.source_stage.translation_m = solution.head<3>();
    for (std::size_t f = 0; f < guess.mount_sensor.size(); ++f) {
        guess.mount_sensor[f].translation_m = solution.segment<3>(3 + 3 * static_cast<Index>(f));
    }
}

void fit_mount_rotations(const std::vector<Solved>& solved, InitialGuess& guess) {
    std::vector<Mat3<double>> sum(guess.mount_sensor.size(), Mat3<double>::Zero());
    for (const Solved& s : solved) {  // O^T = A R B, B: rotation of the mount
        sum[s.file] += s.weight * (guess.source_stage.rotation * s.pose->stage_rotation).transpose() * s.attitude.transpose();
    }
    for (std::size_t f = 0; f < sum.size(); ++f) {
        guess.mount_sensor[f].rotation = nearest_rotation(sum[f]);
    }
}

/// RMS position error. Sets the weight of poses with an error above five times the median to zero.
double update_weights(std::vector<Solved>& solved, double scale, const InitialGuess& guess) {
    std::vector<double> errors;
    for (const Solved& s : solved) {
        const auto truth = true_pose(guess.source_stage, *s.pose, guess.mount_sensor[s.file]);
        errors.push_back((s.position_m / scale - truth.position_m).norm());
    }
    const double limit = 5 * median(errors) + 1e-9;
    double squares = 0;
    double count = 0;
    for (std::size_t i = 0; i < solved.size(); ++i) {
        solved[i].weight = errors[i] < limit ? 1 : 0;
        squares += solved[i].weight * errors[i] * errors[i];
        count += solved[i].weight;
    }
    return std::sqrt(squares / count);
}

/// RMS attitude error with one rotation for each mount, rad.
double attitude_rms(const std::vector<Solved>& solved, const InitialGuess& guess) {
    double squares = 0;
    double weights = 0;
    for (const Solved& s : solved) {
        const auto truth = true_pose(guess.source_stage, *s.pose, guess.mount_sensor[s.file]);
        const double chord = (truth.q_source_sensor.toRotationMatrix() - s.attitude.transpose()).squaredNorm() / 2;
        squares += s.weight * chord;
        weights += s.weight;
    }
    return std::sqrt(squares / weights);
}

InitialGuess guess_with_gains(const std::vector<PoseFile>& files, const SelfCalibration& gains) {
    const PoseList list = all_poses(files);
    InitialGuess guess;
    guess.mount_sensor.resize(files.size());
    guess.sensor = gains.sensor;
    guess.source = gains.source;
    auto solved = solve_all(list, files, guess);
    align_hemispheres(solved);
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
        Mat3<double> linear = linear_part(solved, files.size());
        if (linear.determinant() < 0) {  // all positions have the wrong sign
            for (Solved& s : solved) {
                s.position_m *= -1;
            }
            linear *= -1;
        }
        const double scale = std::cbrt(linear.determinant());  // lengths computed with C = 1 are too short by C^(1/3)
        guess.coupling_constant = 1 / (scale * scale * scale);
        guess.source_stage.rotation = nearest_rotation(linear);
        fit_offsets(solved, scale, guess);
        fit_mount_rotations(solved, guess);
        guess.attitude_rms_rad = attitude_rms(solved, guess);
        guess.position_rms_m = update_weights(solved, scale, guess);
    }
    return guess;
}

}  // namespace

void transpose_rotations(std::span<PoseFile> files) {
    for (PoseFile& file : files) {
        for (MeasuredPose& pose : file.poses) {
            pose.stage_rotation = pose.stage_rotation.transpose();
        }
    }
}

InitialGuess guess_start(const std::vector<PoseFile>& files) {
    check_spread(all_poses(files));
    std::vector<Mat3<double>> frames;
    for (const auto& [pose, file] : all_poses(files)) {
        frames.push_back(pose->x);
    }
    const SelfCalibration gains = self_calibrate(frames, 0.02);
    const InitialGuess as_read = guess_with_gains(files, gains);
    std::vector<PoseFile> turned = files;
    transpose_rotations(turned);
    InitialGuess reversed = guess_with_gains(turned, gains);
    reversed.stage_turns_left_handed = true;
    return reversed.attitude_rms_rad < as_read.attitude_rms_rad ? reversed : as_read;
}

}  // namespace tricoil::host
