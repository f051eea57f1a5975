#include "board/host/calibration/pivot.hpp"
#include "board/support/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "board/support/errors.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/whole_file.hpp"
#include "core/base/angle_units.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMinPivotPoses = 10;
constexpr double kMinTilt_rad = 0.07;            // 4 deg
constexpr double kMinTiltToNoise = 2;            // of the attitudes
constexpr double kMaxResidual_sigmas = 5;        // a larger residual is not caused by noise
constexpr double kMaxResidual_m = 3e-4;          // play of a tip in its hole; a smaller residual is accepted
constexpr double kMaxUnstatedResidual_m = 5e-3;  // the same, of poses without standard deviations
constexpr double kSmallestSigma_m = 1e-6;        // makes the covariance of noise-free poses regular
constexpr double kOutlierSquare = 16.27;         // chi-square with 3 degrees of freedom, 99.9 %
constexpr double kMedian = 2.366;                // its median
constexpr int kTrials = 300;                     // with half of the poses wrong, one trial in 16 has only good poses
constexpr std::size_t kPosesPerTrial = 4;
constexpr std::size_t kScoredPoses = 300;
constexpr int kPasses = 30;
constexpr double kConverged_m = 1e-10;
constexpr std::size_t kBlocks = 20;
// Errors that all poses share do not average out. In simulated motion (scenario pointer) they move the tip by 1 to 2 um, which is
// its standard deviation for about this number of poses.
constexpr double kMostIndependentPoses = 1000;

using Unknowns = Vec6<double>;  // tip (sensor frame), pivot (source frame)
using Poses = std::vector<PivotPose>;

/// Normal equations of the unknowns.
struct Normal {
    Mat6<double> matrix = Mat6<double>::Zero();
    Unknowns side = Unknowns::Zero();

    /// Also for a singular matrix: then the shortest solution.
    [[nodiscard]] Unknowns solve() const { return least_squares(eigen(matrix), eigen(side)); }
};

Matrix<double, 3, 6> design(const PivotPose& pose) {
    Matrix<double, 3, 6> rows;
    rows << pose.q_source_sensor.toRotationMatrix(), -Mat3<double>::Identity();
    return rows;
}

Vec3<double> residual(const PivotPose& pose, const Unknowns& x) {
    return pose.position_m + pose.q_source_sensor * x.head<3>() - x.tail<3>();
}

/// Inverse covariance of a residual, whose error is J (position error, rotation error).
Mat3<double> weight_of(const PivotPose& pose, const Vec3<double>& tip_m) {
    Matrix<double, 3, 6> jacobian;
    jacobian << Mat3<double>::Identity(), -geometry::skew<double>(pose.q_source_sensor * tip_m);
    const Mat3<double> covariance =
        jacobian * pose.covariance * jacobian.transpose() + kSmallestSigma_m * kSmallestSigma_m * Mat3<double>::Identity();
    return covariance.inverse();
}

/// Mean of A^T W r at the true solution, exact to second order in the pose's error. It is not zero, because the attitude in A and
/// W has the error that is also in r.
Unknowns mean_gradient(const PivotPose& pose, const Vec3<double>& tip_m) {
    const SymmetricEigen eigen = eigen_of_symmetric(::tricoil::eigen(pose.covariance));
    const Mat6<double> root = eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
    Unknowns mean = Unknowns::Zero();
    for (Index n = 0; n < 12; ++n) {
        const Vec6<double> error = (n < 6 ? 1 : -1) * root.col(n % 6);
        PivotPose wrong = pose;
        wrong.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(error.tail<3>()) * pose.q_source_sensor;
        const Vec3<double> r = error.head<3>() + wrong.q_source_sensor * tip_m - pose.q_source_sensor * tip_m;
        mean += design(wrong).transpose() * (weight_of(wrong, tip_m) * r) / 2;
    }
    return mean;
}

/// Least median of squares: solutions of a few poses each, of which the one with the smallest median residual is kept.
Unknowns robust_start(const Poses& poses) {
    std::mt19937_64 random(1);
    const std::size_t step = (poses.size() + kScoredPoses - 1) / kScoredPoses;
    std::vector<double> squares;
    Unknowns best = Unknowns::Zero();
    double least = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < kTrials; ++trial) {
        Normal normal;
        for (std::size_t n = 0; n < kPosesPerTrial; ++n) {
            const PivotPose& pose = poses[random() % poses.size()];
            normal.matrix += design(pose).transpose() * design(pose);
            normal.side -= design(pose).transpose() * pose.position_m;
        }
        const Unknowns x = normal.solve();
        squares.clear();
        for (std::size_t n = 0; n < poses.size(); n += step) {
            squares.push_back(residual(poses[n], x).squaredNorm());
        }
        if (const double score = median(squares); score < least) {
            least = score;
            best = x;
        }
    }
    return best;
}

struct Fit {
    Unknowns x;
    Normal normal;
    std::vector<const PivotPose*> used;
    double scale = 1;  // of the residuals, relative to the poses' covariances; robust
};

/// Poses whose residual has the size of the others.
void choose_poses(const Poses& poses, Fit& fit) {
    std::vector<double> squares;
    for (const PivotPose& pose : poses) {
        const Vec3<double> r = residual(pose, fit.x);
        squares.push_back(r.dot(weight_of(pose, fit.x.head<3>()) * r));
    }
    const double variance = median(squares) / kMedian;
    fit.scale = std::sqrt(variance);
    fit.used.clear();
    for (std::size_t n = 0; n < poses.size(); ++n) {
        if (squares[n] <= kOutlierSquare * std::max(1.0, variance)) {
            fit.used.push_back(&poses[n]);
        }
    }
}

void solve_weighted(Fit& fit) {
    const Vec3<double> tip_m = fit.x.head<3>();
    fit.normal = {};
    for (const PivotPose* pose : fit.used) {
        const Mat3<double> weight = weight_of(*pose, tip_m);
        const auto rows = design(*pose);
        fit.normal.matrix += rows.transpose() * weight * rows;
        fit.normal.side += mean_gradient(*pose, tip_m) - rows.transpose() * (weight * pose->position_m);
    }
    fit.x = fit.normal.solve();
}

Fit fit_tip(const Poses& poses) {
    Fit fit;
    fit.x = robust_start(poses);
    for (int pass = 0; pass < kPasses; ++pass) {
        const Unknowns before = fit.x;
        choose_poses(poses, fit);
        solve_weighted(fit);
        if ((fit.x - before).norm() < kConverged_m) {
            break;
        }
    }
    return fit;
}

/// Tilt of the sensor axes: RMS without the errors of the attitudes, in increasing order.
struct Tilt {
    Vec3<double> rms_rad;
    Mat3<double> axes;  // columns, sensor frame
    double noise_rad;   // RMS error of the attitudes in the direction of the first axis
};

Tilt tilt_of(const std::vector<const PivotPose*>& poses) {
    const auto count = static_cast<double>(poses.size());
    Mat3<double> mean = Mat3<double>::Zero();
    Mat3<double> noise = Mat3<double>::Zero();
    for (const PivotPose* pose : poses) {
        const Mat3<double> turn = pose->q_source_sensor.toRotationMatrix();
        const Mat3<double> rotation = turn.transpose() * pose->covariance.bottomRightCorner<3, 3>() * turn;
        mean += turn / count;
        noise += (rotation.trace() * Mat3<double>::Identity() - rotation) / count;
    }
    const Mat3<double> spread = Mat3<double>::Identity() - mean.transpose() * mean - noise;
    const SymmetricEigen eigen = eigen_of_symmetric(::tricoil::eigen(spread));
    const Vec3<double> still = eigen.vectors.col(0);
    return {eigen.values.cwiseMax(0).cwiseSqrt(), eigen.vectors, std::sqrt(still.dot(noise * still))};
}

void check_motion(const Tilt& tilt, const std::string& name) {
    const double least_rad = std::max(kMinTilt_rad, kMinTiltToNoise * tilt.noise_rad);
    const Vec3<double> axis = tilt.axes.col(0);
    refuse_if(tilt.rms_rad(1) < least_rad,
              "{}: the poses turn by only {:.1f} deg RMS, which does not determine the tip; tilt the pointer to all sides by 30 "
              "deg or more, with its tip at rest",
              name, kDegrees * tilt.rms_rad(1));
    refuse_if(tilt.rms_rad(0) < least_rad,
              "{}: the poses turn about one axis only ({:.2f}, {:.2f}, {:.2f} in the sensor frame, tilted by {:.1f} deg RMS), "
              "which does not determine the tip; tilt the pointer to all sides by 30 deg or more",
              name, axis.x(), axis.y(), axis.z(), kDegrees * tilt.rms_rad(0));
}

void check_residual(const Fit& fit, double rms_m, const std::string& name) {
    refuse_if(fit.scale > kMaxResidual_sigmas && rms_m > kMaxResidual_m,
              "{}: the tip is not at rest: residual {:.2f} mm RMS, {:.0f} times the standard deviations of the poses; hold the "
              "tip in a small hole, far from metal, and turn more slowly",
              name, 1e3 * rms_m, fit.scale);
}

/// Ratio of the covariance of the result to the inverse normal matrix, from the sums of the scores over blocks of successive
/// poses. 1 for independent residuals of the expected size; sums are larger if residuals are larger or correlated within a block.
double covariance_inflation(const Fit& fit) {
    const Mat6<double> inverse = Mat6<double>(inverse_of_definite(eigen(fit.normal.matrix)));
    const std::size_t blocks = std::min(kBlocks, fit.used.size());
    double measured = 0;
    double expected = 6;
    for (std::size_t block = 0; block < blocks; ++block) {
        Unknowns score = Unknowns::Zero();
        Mat6<double> information = Mat6<double>::Zero();
        for (std::size_t n = block * fit.used.size() / blocks; n < (block + 1) * fit.used.size() / blocks; ++n) {
            const PivotPose& pose = *fit.used[n];
            const auto rows = design(pose);
            const Mat3<double> weight = weight_of(pose, fit.x.head<3>());
            score += rows.transpose() * (weight * residual(pose, fit.x));
            information += rows.transpose() * weight * rows;
        }
        const Mat6<double> share = information * inverse;
        measured += score.dot(inverse * score);
        expected -= (share * share).trace();
    }
    return std::max({1.0, measured / expected, static_cast<double>(fit.used.size()) / kMostIndependentPoses});
}

constexpr double kManyOutliers = 0.2;  // share of the poses
constexpr double kLargeResidual = 2;   // in standard deviations

Json deviations_of(const Mat3<double>& covariance) { return list_of(covariance.diagonal().cwiseSqrt()); }

Json warnings_of(const PivotRecord& record, const PivotCalibration& found) {
    Json warnings = Json::array();
    if (static_cast<double>(found.outliers) > kManyOutliers * static_cast<double>(record.poses.size())) {
        warnings.push_back(fmt::format("{} of {} poses are outliers; was the tip at rest?", found.outliers, record.poses.size()));
    }
    if (found.residual_sigmas > kLargeResidual) {
        warnings.push_back(
            fmt::format("the residual is {:.1f} times the standard deviations of the poses: a tip that moves, or metal",
                        found.residual_sigmas));
    }
    return warnings;
}

}  // namespace

PivotCalibration calibrate_pivot(std::vector<PivotPose> poses, const std::string& name) {
    refuse_if(poses.size() < kMinPivotPoses, "{}: {} valid poses; at least {} are needed, with the pointer tilted to all sides",
              name, poses.size(), kMinPivotPoses);
    Fit fit = fit_tip(poses);
    const bool is_stated = std::ranges::any_of(poses, [](const PivotPose& pose) { return !pose.covariance.isZero(0); });
    if (!is_stated) {  // standard deviations that the poses do not have are those of the residuals
        for (PivotPose& pose : poses) {
            pose.covariance.topLeftCorner<3, 3>() =
                fit.scale * fit.scale * kSmallestSigma_m * kSmallestSigma_m * Mat3<double>::Identity();
        }
        fit = fit_tip(poses);
    }
    const Tilt tilt = tilt_of(fit.used);
    check_motion(tilt, name);
    PivotCalibration result;
    result.tip_m = fit.x.head<3>();
    result.pivot_m = fit.x.tail<3>();
    result.outliers = poses.size() - fit.used.size();
    double squares = 0;
    double weighted = 0;
    for (const PivotPose* pose : fit.used) {
        const Vec3<double> r = residual(*pose, fit.x);
        squares += r.squaredNorm();
        weighted += r.dot(weight_of(*pose, result.tip_m) * r);
    }
    const auto count = static_cast<double>(fit.used.size());
    result.residual_rms_m = std::sqrt(squares / count);
    result.residual_sigmas = std::sqrt(weighted / (3 * count - 6));
    check_residual(fit, result.residual_rms_m, name);
    refuse_if(!is_stated && result.residual_rms_m > kMaxUnstatedResidual_m,
              "{}: the tip is not at rest: residual {:.2f} mm RMS; hold the tip in a small hole", name,
              1e3 * result.residual_rms_m);
    result.inflation = covariance_inflation(fit);
    const Mat6<double> covariance = result.inflation * Mat6<double>(inverse_of_definite(eigen(fit.normal.matrix)));
    result.tip_covariance_m2 = covariance.topLeftCorner<3, 3>();
    result.pivot_covariance_m2 = covariance.bottomRightCorner<3, 3>();
    result.tilt_deg = kDegrees * tilt.rms_rad(0);
    return result;
}

Json pivot_result(const PivotRecord& record, const std::string& out) {
    const PivotCalibration found = calibrate_pivot(record.poses, record.name);
    const ToolTip tip{record.sensor, found.tip_m, found.tip_covariance_m2};
    if (!out.empty()) {
        write_whole_file(out, to_toml(tip));
    }
    return {{"sensor", record.sensor},
            {"poses", record.poses.size()},
            {"invalid", record.invalid},
            {"outliers", found.outliers},
            {"tip_m", list_of(found.tip_m)},
            {"tip_std_m", deviations_of(found.tip_covariance_m2)},
            {"tip_covariance_m2", rows_of(found.tip_covariance_m2)},
            {"pivot_m", list_of(found.pivot_m)},
            {"pivot_std_m", deviations_of(found.pivot_covariance_m2)},
            {"residual_rms_m", found.residual_rms_m},
            {"residual_sigmas", found.residual_sigmas},
            {"covariance_inflation", found.inflation},
            {"tilt_deg", found.tilt_deg},
            {"option", fmt::format("{}:{:.6f},{:.6f},{:.6f}", record.sensor, found.tip_m(0), found.tip_m(1), found.tip_m(2))},
            {"warnings", warnings_of(record, found)},
            {"out", out}};
}

}  // namespace tricoil::host
