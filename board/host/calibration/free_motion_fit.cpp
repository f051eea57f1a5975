#include "board/host/calibration/free_motion_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_quality.hpp"
#include "board/host/calibration/pose_residual.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/errors.hpp"
#include "core/geometry/angles.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/direct.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kRange_m = 0.25;          // median range during the fit; the result is scaled to the coupling constant
constexpr double kWeakShare = 5e-3;        // larger position errors from the coils, relative to the range, cause a warning
constexpr double kMeanMomentError = 1e-6;  // standard deviation of the prior of the mean moment
constexpr double kUnusual = 3;             // a larger misfit is unusual, in medians
constexpr int kFitsPerModel = 3;           // the hemisphere of every pose is tested between them

/// Standard deviation of the prior of a parameter, in its internal unit. Lengths at a range of 0.25 m: an offset of 5 mm, an
/// octupole of 200 mm2 (a coil of 80 mm diameter).
double prior_deviation(int parameter) { return parameter < kSourceOffsets ? 0.3 : parameter < kOctupoles ? 0.05 : 0.02; }

class BundleFit {
public:
    BundleFit(const std::vector<Mat3<double>>& frames, FitModel model, const Vec3<double>& hemisphere)
        : model_(model), hemisphere_(hemisphere) {
        const SelfCalibration gains = self_calibrate(frames);
        magnetic_ = parameters_of(gains.source, gains.sensor);
        ideal_ = {1, 1, 1, 0, 0, 0, 1, 1};
        for (const Mat3<double>& x : frames) {
            measured_.push_back({{x}, Vec3<double>::Zero(), Mat3<double>::Identity()});
        }
        start_poses(gains);
    }

    void solve(const ShowShare& progress) {
        double loss_m = kFirstLoss_m;
        const int last = static_cast<int>(model_);
        for (int stage = 1; stage <= last; ++stage) {
            for (int round = 0; round < kFitsPerModel; ++round) {
                if (progress) {
                    progress((kFitsPerModel * (stage - 1) + round) / double(kFitsPerModel * last));
                }
                solve_once(static_cast<FitModel>(stage), loss_m);
                loss_m = loss_of(norms_m());
                choose_hemispheres();
            }
        }
        solve_once(model_, loss_m);
    }

    FreeMotionFit result(double coupling_constant) {
        FreeMotionFit result;
        const double scale = std::cbrt(coupling_constant / coupling_constant_);
        CalibrationFit& fit = result.coils;
        fit.coupling_constant = coupling_constant_;
        fit.poses = poses_.size();
        fit.model = model_of(magnetic_.data(), coupling_constant_);
        const double limit = kOutlierMedians * median(norms_m()) + 1e-12;
        FileResidual residual{"", poses_.size()};
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            const Mat3<double> o = poses_[k].q_source_sensor.toRotationMatrix().transpose();
            const Mat3<double> x = field::signal_matrix<double>(fit.model, poses_[k].position_m, o);
            const double share = (x - measured_[k].x).norm() / measured_[k].x.norm();
            result.misfit_shares.push_back(share);
            if (linearised(k).residual.norm() <= limit) {
                residual.squares += share * share;
                ++residual.used;
            }
        }
        result.outliers = residual.poses - residual.used;
        check_residuals_of_motion(residual, model_, fit);
        const ParameterEstimate linear = estimate(limit);
        check_parameters(linear, fit);
        const Eigen::MatrixXd covariance =
            sigma_m_ * sigma_m_ * inverse_of_definite(linear.jacobian.transpose() * linear.jacobian);
        widen_deviations(covariance, fit);
        const double noise_share = position_error_m(covariance) / kRange_m;
        result.position_error_share = systematic() * noise_share;
        fit.errors = coil_errors(result.position_error_share);
        warn_of_weak_motion(result.position_error_share, noise_share, fit);
        fit = with_scaled_lengths(std::move(fit), scale);
        result.poses = poses_;
        for (auto& pose : result.poses) {
            pose.position_m *= scale;
        }
        return result;
    }

private:
    void start_poses(const SelfCalibration& gains) {
        std::vector<double> ranges;  // with C = 1
        for (const MeasuredPose& measured : measured_) {
            const auto s = solver::solve_direct<double>(corrected(measured.x, gains.sensor, gains.source), 1.0);
            if (!s.ok() || !s->right_handed) {
                throw InputError(
                    fmt::format("column frame {}: the couplings are left-handed or degenerate; correct the wiring or the signs "
                                "(tricoil calibrate wiring)",
                                poses_.size() + 1));
            }
            poses_.push_back({s->position_towards(hemisphere_), geometry::attitude_quaternion(s->attitude)});
            ranges.push_back(s->range_m);
        }
        const double scale = kRange_m / median(ranges);
        coupling_constant_ = scale * scale * scale;
        for (auto& pose : poses_) {
            pose.position_m *= scale;
        }
    }

    [[nodiscard]] PoseTerms terms(std::size_t k, bool finite) const {
        const auto weight = pose_weight(model_of(magnetic_.data(), coupling_constant_), poses_[k],
                                        metres_per_coupling(measured_[k].x, coupling_constant_));
        return {measured_[k],
                Mat3<double>::Identity(),
                poses_[k].q_source_sensor.toRotationMatrix(),
                Mat3<double>::Identity(),
                coupling_constant_,
                weight,
                finite};
    }

    void solve_once(FitModel model, double loss_m) {
        ceres::Problem problem;
        std::vector<RigidBlock> blocks;
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            blocks.push_back(rigid_block(poses_[k].position_m));
        }
        RigidBlock no_source{};
        RigidBlock no_jig{};
        std::array<double, kStage> no_stage{};
        std::array<double, kPickUp> no_pick_up{};
        ceres::Solver::Options options = silent_options(ceres::DENSE_SCHUR, 50);
        options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
        options.linear_solver_ordering->AddElementToGroup(magnetic_.data(), 1);
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            problem.AddResidualBlock(new PoseResidual(terms(k, model == FitModel::finite)), new ceres::CauchyLoss(loss_m),
                                     magnetic_.data(), no_source.data(), blocks[k].data(), no_jig.data(), no_stage.data(),
                                     no_pick_up.data());
            options.linear_solver_ordering->AddElementToGroup(blocks[k].data(), 0);
        }
        for (double* constant : {no_source.data(), no_jig.data(), no_stage.data(), no_pick_up.data()}) {
            problem.SetParameterBlockConstant(constant);
            options.linear_solver_ordering->AddElementToGroup(constant, 1);
        }
        hold_parameters(problem, magnetic_.data(), free_magnetic(model));
        sigma_m_ = loss_m / kLossMedians;
        const auto [rows, target] = prior();
        problem.AddResidualBlock(new ceres::NormalPrior(rows, target), nullptr, magnetic_.data());
        options.function_tolerance = 1e-9;
        options.num_threads = 2;
        solve_usably(problem, options);
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            const Mat3<double> turned = poses_[k].q_source_sensor.toRotationMatrix() * rotation_of(blocks[k].data() + 3);
            poses_[k] = {length_of(blocks[k].data()), Quat<double>(turned).normalized()};
        }
    }

    /// Prior of the parameters, and of their mean moment, in metres like the residuals.
    [[nodiscard]] std::pair<Eigen::MatrixXd, Eigen::VectorXd> prior() const {
        Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kMagnetic, kMagnetic);
        for (int k = 0; k < kMagnetic; ++k) {
            rows(k, k) = sigma_m_ / prior_deviation(k);
        }
        rows.row(0).head<3>().setConstant(sigma_m_ /
                                          kMeanMomentError);  // moment xx has the prior of the other two and of the sum
        return {rows, Eigen::Map<const Eigen::VectorXd>(ideal_.data(), kMagnetic)};
    }

    /// A pose and its mirror image have equal couplings if all coils of a triad have one centre. The offsets tell them apart: a
    /// pose is mirrored if its misfit is unusual and the mirror image's is not.
    void choose_hemispheres() {
        const auto model = model_of(magnetic_.data(), coupling_constant_);
        const auto solved = [&](std::size_t k, const solver::RigidPose<double>& start) {
            const auto found = solver::minimise<double>(model, measured_[k].x, Mat3<double>::Ones(), start);
            return found.ok() ? *found : solver::Minimum<double>{};
        };
        std::vector<double> shares;
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            shares.push_back(solved(k, poses_[k]).misfit_share);
        }
        const double usual = kUnusual * median(shares);
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            if (shares[k] > usual) {
                const auto mirrored = solved(k, {-poses_[k].position_m, poses_[k].q_source_sensor});
                if (mirrored.converged() && mirrored.misfit_share < usual) {
                    poses_[k] = mirrored.pose;
                }
            }
        }
    }

    struct Linearised {
        Eigen::Matrix<double, 9, 1> residual;
        Eigen::Matrix<double, 9, kMagnetic, Eigen::RowMajor> by_magnetic;
        Eigen::Matrix<double, 9, kRigid, Eigen::RowMajor> by_pose;
    };

    [[nodiscard]] Linearised linearised(std::size_t k) const {
        Linearised result;
        const RigidBlock pose = rigid_block(poses_[k].position_m);
        const RigidBlock nothing{};
        const std::array<double, kStage> no_stage{};
        const std::array<double, kPickUp> no_pick_up{};
        const std::array<const double*, 6> blocks{magnetic_.data(), nothing.data(),  pose.data(),
                                                  nothing.data(),   no_stage.data(), no_pick_up.data()};
        std::array<double*, 6> jacobians{result.by_magnetic.data(), nullptr, result.by_pose.data(), nullptr, nullptr, nullptr};
        PoseResidual(terms(k, model_ == FitModel::finite)).Evaluate(blocks.data(), result.residual.data(), jacobians.data());
        return result;
    }

    [[nodiscard]] std::vector<double> norms_m() const {
        std::vector<double> norms;
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            norms.push_back(linearised(k).residual.norm());
        }
        return norms;
    }

    /// Linearised fit of the magnetic parameters: what no pose explains, and the prior.
    [[nodiscard]] ParameterEstimate estimate(double limit) const {
        const auto free = static_cast<Index>(free_magnetic(model_));
        const auto rows = 9 * static_cast<Index>(poses_.size());
        ParameterEstimate estimate;
        estimate.outlier_limit_m = limit;
        estimate.magnetic = std::span(magnetic_).first(static_cast<std::size_t>(free));
        estimate.jacobian = Eigen::MatrixXd::Zero(rows + free, free);
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            const Linearised at = linearised(k);
            const Eigen::Matrix<double, 9, 3> unexplained = orthogonal_complement(at.by_pose);
            const Eigen::Matrix<double, 9, 1> residual = unexplained * (unexplained.transpose() * at.residual);
            estimate.residuals.insert(estimate.residuals.end(), residual.data(), residual.data() + 9);
            estimate.jacobian.middleRows<9>(9 * static_cast<Index>(k)) =
                unexplained * (unexplained.transpose() * at.by_magnetic.leftCols(free));
        }
        estimate.jacobian.bottomRows(free) = prior().first.topLeftCorner(free, free);
        return estimate;
    }

    /// Ratio of the true deviations to those of independent residuals. Residuals of real coils are systematic, so only as many as
    /// there are parameters count as independent, not three redundant numbers per pose (measured on recorded couplings: see
    /// README).
    [[nodiscard]] double systematic() const {
        return std::max(1.0, std::sqrt(3 * static_cast<double>(poses_.size()) / free_magnetic(model_)));
    }

    /// Includes what the prior leaves open in the deviations, and systematic residuals, up to the deviation of the prior.
    void widen_deviations(const Eigen::MatrixXd& covariance, CalibrationFit& fit) const {
        for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
            const auto index = static_cast<Index>(k);
            double& deviation = fit.parameters[k].deviation;
            const double largest = unit_of(k) * prior_deviation(static_cast<int>(k));
            deviation = std::min(systematic() * std::max(deviation, unit_of(k) * std::sqrt(covariance(index, index))), largest);
        }
    }

    /// Warns of data that determine the coils weakly, with the parameter that is least determined relative to its prior.
    static void warn_of_weak_motion(double share_of_range, double noise_share, CalibrationFit& fit) {
        if (share_of_range < kWeakShare) {
            return;
        }
        const auto open_share = [](const FittedParameter& p, std::size_t k) {
            return p.deviation / (unit_of(k) * prior_deviation(static_cast<int>(k)));
        };
        std::size_t weakest = 0;
        for (std::size_t k = 1; k < fit.parameters.size(); ++k) {
            if (open_share(fit.parameters[k], k) > open_share(fit.parameters[weakest], weakest)) {
                weakest = k;
            }
        }
        fit.warnings.push_back(
            fmt::format("these data determine the coils weakly: positions are uncertain by {:.1f} % of the range, or {:.2f} % if "
                        "the unexplained {:.2f} % of the couplings are only noise; least determined: {}. Turn the sensor about "
                        "all its axes at places all around, or use --model concentric",
                        100 * share_of_range, 100 * noise_share, 100 * fit.residual_rms, fit.parameters[weakest].name));
    }

    /// RMS error of the positions that errors of the magnetic parameters cause. What equals a rigid motion or a scale of all
    /// positions is not counted.
    [[nodiscard]] double position_error_m(const Eigen::MatrixXd& covariance) const {
        const SymmetricEigen eigen = eigen_of_symmetric(covariance);
        const Eigen::MatrixXd root = eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
        const auto rows = 3 * static_cast<Index>(poses_.size());
        Eigen::MatrixXd moved(rows, root.cols());  // positions for one standard deviation along each eigenvector
        Eigen::MatrixXd similarity(rows, 7);
        for (std::size_t k = 0; k < poses_.size(); ++k) {
            const Linearised at = linearised(k);
            const Eigen::Matrix<double, 9, 6> by_pose = at.by_pose;
            const Eigen::MatrixXd step =
                least_squares(by_pose, at.by_magnetic.leftCols(root.rows()) * root).topRows<3>() * kLengthUnit_m;
            const auto row = 3 * static_cast<Index>(k);
            const Vec3<double>& p = poses_[k].position_m;
            moved.middleRows<3>(row) = step;
            similarity.middleRows<3>(row) << Eigen::Matrix3d::Identity(), ::tricoil::eigen(geometry::skew<double>(p)),
                ::tricoil::eigen(p);
        }
        const Eigen::MatrixXd rest = moved - similarity * least_squares(similarity, moved);
        return rest.norm() / std::sqrt(static_cast<double>(poses_.size()));
    }

    FitModel model_;
    Vec3<double> hemisphere_;
    double coupling_constant_ = 1;
    double sigma_m_ = 0;  // median norm of the residuals
    std::array<double, kMagnetic> magnetic_{}, ideal_{};
    std::vector<MeasuredPose> measured_;
    std::vector<solver::RigidPose<double>> poses_;
};

}  // namespace

field::GeneralDipole<double> with_scaled_lengths(field::GeneralDipole<double> model, double factor) {
    model.source_moment *= factor * factor * factor;
    model.source_offset_m *= factor;
    model.sensor_offset_m *= factor;
    model.source_octupole_m2 *= factor * factor;
    model.sensor_octupole_m2 *= factor * factor;
    return model;
}

CalibrationFit with_scaled_lengths(CalibrationFit fit, double factor) {
    fit.model = with_scaled_lengths(fit.model, factor);
    fit.coupling_constant *= factor * factor * factor;
    for (std::size_t k = kSourceOffsets; k < fit.parameters.size(); ++k) {
        const double power = k < kOctupoles ? factor : factor * factor;
        fit.parameters[k].value *= power;
        fit.parameters[k].deviation *= power;
    }
    return fit;
}

FreeMotionFit fit_free_motion(const std::vector<Mat3<double>>& frames, FitModel model, double coupling_constant,
                              const Vec3<double>& hemisphere, const ShowShare& progress) {
    BundleFit fit(frames, model, hemisphere);
    fit.solve(progress);
    return fit.result(coupling_constant);
}

}  // namespace tricoil::host
