#include "board/host/calibration/fit_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "board/support/errors.hpp"
#include "core/geometry/angles.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/pose_covariance.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kMaxCondition = 1e6;           // of the normalised Jacobian; above it the calibration is refused
constexpr double kWarnCondition = 2e4;          // above it a warning is added
constexpr double kMixedFactor = 4;              // limit of a file's residual relative to that of the median file
constexpr double kMixedShare = 5e-3;            // share of the couplings; a file above both limits does not belong to the set
constexpr double kPoorShare = 0.02;             // a larger residual causes a warning
constexpr double kMaxConcentricResidual = 0.3;  // share of the couplings; a larger residual is refused
constexpr double kMaxGeneralResidual = 0.05;    // the same for models with offsets, which usually leave a few per mille
constexpr double kFixtureTolerance_deg = 5;

/// Of a magnetic parameter, with its unit; in the order of fit_parameters.hpp.
std::string name_of(std::size_t parameter) {
    constexpr std::array<const char*, kSourceOffsets> kShapes{"xx", "yy", "zz", "xy", "xz", "yz", "xx", "yy", "xy", "xz", "yz"};
    const auto k = static_cast<int>(parameter);
    if (k < kSourceOffsets) {
        return fmt::format("{} {}", k < kSensitivities ? "moment" : "sensitivity", kShapes[parameter]);
    }
    if (k < kOctupoles) {
        const int n = (k - kSourceOffsets) % 6;
        return fmt::format("{} {} {} mm", k < kSensorOffsets ? "source" : "sensor", n / 3 + 1, "xyz"[n % 3]);
    }
    return fmt::format("{} {} octupole mm2", k < kOctupoles + 3 ? "source" : "sensor", (k - kOctupoles) % 3 + 1);
}

/// Refuses files that were recorded with other coils, gains or mounts than the rest of the set.
void refuse_mixed_sets(const std::vector<FileResidual>& files) {
    for (std::size_t f = 0; f < files.size(); ++f) {
        std::vector<double> others;
        for (std::size_t other = 0; other < files.size(); ++other) {
            if (other != f) {
                others.push_back(files[other].rms());
            }
        }
        const double rms = files[f].rms();
        const std::size_t outliers = files[f].poses - files[f].used;
        const bool worse = !others.empty() && rms > kMixedFactor * median(others) && rms > kMixedShare;
        refuse_if(2 * outliers > files[f].poses || worse,
                  "{}: {} of {} poses do not fit the model of the whole set (residual {:.2g} of the couplings); it was recorded "
                  "with other coils or gains, or metal or a cable moved: calibrate it by itself",
                  files[f].path, outliers, files[f].poses, rms);
    }
}

void refuse_unexplained(const std::vector<FileResidual>& files, FitModel model) {
    const auto worst = std::max_element(files.begin(), files.end(),
                                        [](const FileResidual& a, const FileResidual& b) { return a.rms() < b.rms(); });
    if (worst->rms() > (model == FitModel::concentric ? kMaxConcentricResidual : kMaxGeneralResidual)) {
        throw InputError(fmt::format(
            "{}: no start was found from which the model explains the couplings; the best leaves {:.0f} %, the largest "
            "share of all files. Causes: files of different coils or gains, coils swapped within the set, stage "
            "numbers of other couplings, or coils too large or too near for dipoles",
            worst->path, 100 * worst->rms()));
    }
}

void warn_of_unexplained(FitModel model, CalibrationFit& fit) {
    if (fit.residual_rms > kPoorShare) {
        fit.warnings.push_back(fmt::format("the model leaves {:.1f} % of the couplings unexplained{}", 100 * fit.residual_rms,
                                           model == FitModel::concentric ? "; try --model general" : ""));
    }
}

/// Covariance for any distribution of the residuals: (J^T J)^-1 (sum over poses of J_k^T r_k r_k^T J_k) (J^T J)^-1 (White 1980,
/// Econometrica 48(4)). Residuals of neighbouring poses may be correlated: sums over windows of poses take the place of single
/// poses (Newey and West 1987, Econometrica 55(3)), and the fit makes residuals smaller. `eigen`: of J^T J with columns divided
/// by `norms`.
Eigen::MatrixXd covariance_of(const ParameterEstimate& estimate, const SymmetricEigen& eigen, const Eigen::VectorXd& norms) {
    const Eigen::VectorXd inverse = eigen.values.cwiseMax(1e-300).cwiseInverse();
    const Eigen::MatrixXd covariance = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();
    const Eigen::MatrixXd& jacobian = estimate.jacobian;
    Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(static_cast<Index>(estimate.residuals.size() / 9), jacobian.cols());
    for (Index k = 0; k < scores.rows(); ++k) {
        const Eigen::Map<const Eigen::Matrix<double, 9, 1>> r(estimate.residuals.data() + 9 * k);
        if (r.norm() <= estimate.outlier_limit_m) {
            scores.row(k) = r.transpose() * jacobian.middleRows<9>(9 * k) * norms.cwiseInverse().asDiagonal();
        }
    }
    const auto length = static_cast<Index>(std::cbrt(static_cast<double>(scores.rows())));
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(scores.rows() + length - 1, scores.cols());
    for (Index shift = 0; shift < length; ++shift) {
        sums.middleRows(shift, scores.rows()) += scores / std::sqrt(static_cast<double>(length));
    }
    const Eigen::MatrixXd spread = sums * covariance * norms.cwiseInverse().asDiagonal();
    const auto rows = static_cast<double>(estimate.residuals.size());
    return rows / std::max(rows - static_cast<double>(jacobian.cols()), 1.0) * spread.transpose() * spread;
}

/// Position errors relative to the range, for one standard deviation along each eigenvector of the covariance.
std::vector<Eigen::Matrix3Xd> position_errors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                                              const std::vector<PoseEffect>& poses) {
    const SymmetricEigen eigen = eigen_of_symmetric(covariance);
    const Eigen::MatrixXd root = eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
    std::vector<Eigen::Matrix3Xd> errors;
    for (std::size_t k = 0; k < poses.size(); ++k) {
        const Eigen::MatrixXd moved = jacobian.middleRows<9>(9 * static_cast<Index>(k)).leftCols(root.rows()) * root;
        errors.emplace_back(least_squares(::tricoil::eigen(poses[k].by_pose), moved).topRows<3>() / poses[k].position_m.norm());
    }
    return errors;
}

}  // namespace

calibration::CoilErrors<double> coil_errors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                                            const std::vector<PoseEffect>& poses) {
    const auto errors = position_errors(covariance, jacobian, poses);
    const auto count = static_cast<double>(poses.size());
    Eigen::RowVectorXd common = Eigen::RowVectorXd::Zero(covariance.cols());
    for (std::size_t k = 0; k < poses.size(); ++k) {
        common += eigen(poses[k].position_m.normalized()).transpose() * errors[k] / count;
    }
    double squares = 0;  // in units of what an error of each coupling causes
    for (std::size_t k = 0; k < poses.size(); ++k) {
        const Vec3<double> u = poses[k].position_m.normalized();
        const Mat3<double> unit = solver::pose_covariance<double>(1, 1, u, 1).topLeftCorner<3, 3>();
        const Eigen::Matrix3Xd rest = errors[k] - eigen(u) * common;
        squares += (eigen(unit.inverse()) * rest).cwiseProduct(rest).sum() / (3 * count);
    }
    return calibration::CoilErrors<double>::within_limits(3 * common.norm(), std::sqrt(squares));
}

double unit_of(std::size_t parameter) {
    const auto k = static_cast<int>(parameter);
    return k < kSourceOffsets ? 1 : k < kOctupoles ? 1e3 * kLengthUnit_m : 1e6 * kLengthUnit_m * kLengthUnit_m;
}

double degrees_between(const Mat3<double>& a, const Mat3<double>& b) {
    return geometry::angle_between(Quat<double>(a), Quat<double>(b)) * 180 / std::numbers::pi;
}

int free_magnetic(FitModel model) {
    return model == FitModel::concentric ? kSourceOffsets : model == FitModel::general ? kOctupoles : kMagnetic;
}

double FileResidual::rms() const { return used > 0 ? std::sqrt(squares / static_cast<double>(used)) : 1; }

void set_residuals(const std::vector<FileResidual>& files, FitModel model, CalibrationFit& fit) {
    double squares = 0;
    std::size_t used = 0;
    for (const FileResidual& file : files) {
        fit.residual_rms_by_file[file.path] = file.rms();
        squares += file.squares;
        used += file.used;
    }
    fit.residual_rms = std::sqrt(squares / std::max(static_cast<double>(used), 1.0));
    warn_of_unexplained(model, fit);
}

void refuse_residuals(const std::vector<FileResidual>& files, FitModel model) {
    refuse_mixed_sets(files);
    refuse_unexplained(files, model);
}

void check_residuals_of_motion(const FileResidual& data, FitModel model, CalibrationFit& fit) {
    fit.residual_rms = data.rms();
    const std::size_t outliers = data.poses - data.used;
    refuse_if(2 * outliers > data.poses || fit.residual_rms > kMaxGeneralResidual,
              "the model leaves {:.1f} % of the couplings unexplained, {} of {} column frames are outliers; causes: noise, "
              "motion within a column frame (see --column-skew), metal, or a gain that changed",
              100 * fit.residual_rms, outliers, data.poses);
    warn_of_unexplained(model, fit);
}

Eigen::MatrixXd check_parameters(const ParameterEstimate& estimate, CalibrationFit& fit) {
    const Eigen::VectorXd norms = estimate.jacobian.colwise().norm().cwiseMax(1e-300);
    const Eigen::MatrixXd normalised = estimate.jacobian * norms.cwiseInverse().asDiagonal();
    const SymmetricEigen eigen = eigen_of_symmetric(normalised.transpose() * normalised);
    fit.condition = std::sqrt(eigen.values(eigen.values.size() - 1) / std::max(eigen.values(0), 1e-300));
    Eigen::MatrixXd covariance = covariance_of(estimate, eigen, norms);
    const Eigen::VectorXd deviation = covariance.diagonal().cwiseSqrt();
    for (std::size_t k = 0; k < estimate.magnetic.size(); ++k) {
        const double unit = unit_of(k);
        fit.parameters.push_back({name_of(k), unit * estimate.magnetic[k], unit * deviation(static_cast<Index>(k))});
    }
    fit.pick_up_sigma = estimate.has_pick_up ? deviation.tail<kPickUp>().norm() / 3 : 0;
    Index index = 0;
    eigen.vectors.col(0).cwiseAbs().maxCoeff(&index);
    const auto weakest = static_cast<std::size_t>(index);
    const std::string name =
        weakest < estimate.magnetic.size() ? name_of(weakest) : "a fixture's position or rotation, or an error of the stage";
    refuse_if(fit.condition > kMaxCondition,
              "the poses do not determine all parameters (condition number {:.1e}); least determined: {}. Add poses that turn "
              "and move the sensor in more directions, or use --model concentric",
              fit.condition, name);
    if (fit.condition > kWarnCondition) {
        fit.warnings.push_back(
            fmt::format("parameters are weakly determined (condition number {:.1e}); least determined: {}", fit.condition, name));
    }
    const auto magnetic = static_cast<Index>(estimate.magnetic.size());
    return covariance.topLeftCorner(magnetic, magnetic);
}

void check_fixture_names(const std::vector<std::string>& sensor_fixtures, CalibrationFit& fit) {
    for (std::size_t i = 1; i < sensor_fixtures.size(); ++i) {
        const auto first = rotation_of_fixture(sensor_fixtures[0]);
        const auto other = rotation_of_fixture(sensor_fixtures[i]);
        if (!first || !other) {
            continue;
        }
        const double off = degrees_between(first->transpose() * fit.mount_sensor.at(sensor_fixtures[0]).rotation,
                                           other->transpose() * fit.mount_sensor.at(sensor_fixtures[i]).rotation);
        if (off > kFixtureTolerance_deg) {
            fit.warnings.push_back(
                fmt::format("the rotation between fixtures '{}' and '{}' differs by {:.1f} deg from that in their names: a name "
                            "is wrong, or coils of the sensor are reversed or swapped between the files",
                            sensor_fixtures[0], sensor_fixtures[i], off));
        }
    }
}

}  // namespace tricoil::host
