#include "board/host/calibration/surroundings_fit.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_quality.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr Index kLeastPlaces = 18;     // 3 x 3 x 2 nodes
constexpr double kSamePlace_m = 1e-3;  // places nearer to each other than this are one
constexpr double kLeastSpread = 0.05;  // of the places along their shortest axis, relative to the longest
constexpr double kClearance = 0.2;     // of a dipole from source and poses, relative to the range of the nearest pose
constexpr double kWorthwhile = 0.9;    // a dipole must reduce the standard deviation of the residuals to this share

/// Keeps a dipole at a distance from a pose or the source: the residual is the missing distance, m.
class Clearance final : public ceres::CostFunction {
public:
    Clearance(const Vec3<double>& from_m, double least_m, int dipole, int dipoles)
        : from_m_(from_m), least_m_(least_m), dipole_(dipole), dipoles_(dipoles) {
        set_num_residuals(1);
        *mutable_parameter_block_sizes() = {kDipole * dipoles};
    }

    bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
        const Vec3<double> away = length_of(blocks[0] + kDipole * dipole_) - from_m_;
        const double distance_m = away.norm();
        residual[0] = std::max(least_m_ - distance_m, 0.0);
        if (jacobians != nullptr && jacobians[0] != nullptr) {
            std::fill_n(jacobians[0], kDipole * dipoles_, 0.0);
            if (residual[0] > 0 && distance_m > 0) {
                copy_rows(-kLengthUnit_m / distance_m * away, jacobians[0] + kDipole * dipole_);
            }
        }
        return true;
    }

private:
    Vec3<double> from_m_;
    double least_m_;
    int dipole_;
    int dipoles_;
};

void check_places(const std::vector<PlacedCouplings>& poses) {
    Eigen::Matrix3Xd places(3, 0);
    for (const PlacedCouplings& pose : poses) {
        const Eigen::Vector3d place = eigen(pose.place_m);
        if (places.cols() == 0 || (places.colwise() - place).colwise().norm().minCoeff() >= kSamePlace_m) {
            places.conservativeResize(Eigen::NoChange, places.cols() + 1);
            places.rightCols<1>() = place;
        }
    }
    refuse_if(places.cols() < kLeastPlaces,
              "the poses are at {} places; surroundings need {}, for example a grid of 3 x 3 x 2 nodes", places.cols(),
              kLeastPlaces);
    if (const Eigen::VectorXd extent = extents(places); extent(2) < kLeastSpread * extent(0)) {
        throw InputError("the poses lie in one plane or on one line; surroundings need a grid of several levels");
    }
}

/// Linearised fit at the present solution.
struct LinearisedPose {
    solver::RigidPose<double> pose;
    Matrix<double, 9, 9> weight;
    Eigen::Matrix<double, 9, 1> residual;               // weighted
    Eigen::Matrix<double, 9, Eigen::Dynamic> nuisance;  // weighted; of unknowns that all poses share
    Eigen::Matrix<double, 9, Eigen::Dynamic> own;       // weighted; of unknowns of this pose
};

using DipoleBlock = std::array<double, kDipole>;

constexpr int kSteps = 4;  // of the search grid over the distance of the farthest pose; the grid extends so far beyond all poses
constexpr double kRidge = 1e-9;  // relative; keeps the normal matrix definite where a part of the polarisability has no effect
constexpr int kPolarisability = kDipole - 3;

/// Removes from residual, weight and shared unknowns what the pose's own unknowns can explain.
void project(LinearisedPose& pose) {
    if (pose.own.cols() == 0) {
        return;
    }
    const Eigen::MatrixXd inverse = inverse_of_definite(pose.own.transpose() * pose.own);
    const Eigen::Matrix<double, 9, 9> rest = Eigen::Matrix<double, 9, 9>::Identity() - pose.own * inverse * pose.own.transpose();
    pose.residual = rest * pose.residual;
    pose.weight = rest * eigen(pose.weight);
    pose.nuisance = rest * pose.nuisance;
}

/// Normal equations of the polarisability at one place and of the shared unknowns.
struct Trial {
    double explained = 0;  // decrease of the sum of squares
    Eigen::Matrix<double, kPolarisability, 1> polarisability;
};

Trial fit_at(const field::GeneralDipole<double>& coils, const std::vector<LinearisedPose>& poses, const Vec3<double>& place_m) {
    const Index shared = poses.front().nuisance.cols();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kPolarisability + shared, kPolarisability + shared);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(kPolarisability + shared);
    Eigen::Matrix<double, 9, Eigen::Dynamic> jacobian(9, kPolarisability + shared);
    for (const LinearisedPose& pose : poses) {
        const Mat3<double> o = pose.pose.q_source_sensor.toRotationMatrix().transpose();
        const auto by_dipole = dipole_derivatives(coils, {place_m, Mat3<double>::Zero()}, pose.pose.position_m, o);
        jacobian.leftCols<kPolarisability>() = eigen(pose.weight * by_dipole.rightCols<kPolarisability>());
        jacobian.rightCols(shared) = pose.nuisance;
        normal += jacobian.transpose() * jacobian;
        right -= jacobian.transpose() * pose.residual;
    }
    // Parameters of very different effect: scaled to a unit diagonal.
    const Eigen::VectorXd scale = (normal.diagonal().array() + std::numeric_limits<double>::min()).sqrt().inverse();
    normal = scale.asDiagonal() * normal * scale.asDiagonal();
    normal.diagonal().array() += kRidge;
    right = scale.cwiseProduct(right);
    const Eigen::VectorXd solution = least_squares(normal, right);
    return {right.dot(solution), scale.cwiseProduct(solution).head<kPolarisability>()};
}

/// The best of a grid of places around source and poses, none nearer than `clearance_m` to them, with the polarisability that
/// least squares gives there.
DipoleBlock best_dipole(const field::GeneralDipole<double>& coils, std::vector<LinearisedPose> poses, double clearance_m) {
    Vec3<double> least = Vec3<double>::Zero();
    Vec3<double> most = Vec3<double>::Zero();
    double reach_m = 0;
    for (LinearisedPose& pose : poses) {
        least = least.cwiseMin(pose.pose.position_m);
        most = most.cwiseMax(pose.pose.position_m);
        reach_m = std::max(reach_m, pose.pose.position_m.norm());
        project(pose);
    }
    const double step_m = reach_m / kSteps;
    const auto is_clear = [&](const Vec3<double>& place_m) {
        return place_m.norm() >= clearance_m && std::all_of(poses.begin(), poses.end(), [&](const LinearisedPose& pose) {
                   return (place_m - pose.pose.position_m).norm() >= clearance_m;
               });
    };
    DipoleBlock best{};
    double explained = -1;
    const Vec3<double> first = least - Vec3<double>::Constant(reach_m);
    const auto steps = ((most - least) / step_m).unaryExpr([](double n) { return static_cast<int>(std::ceil(n + 2 * kSteps)); });
    for (int x = 0; x <= steps.x(); ++x) {
        for (int y = 0; y <= steps.y(); ++y) {
            for (int z = 0; z <= steps.z(); ++z) {
                const Vec3<double> place_m = first + step_m * Vec3<double>(x, y, z);
                if (!is_clear(place_m)) {
                    continue;
                }
                const Trial trial = fit_at(coils, poses, place_m);
                if (trial.explained > explained) {
                    explained = trial.explained;
                    copy_rows(place_m / kLengthUnit_m, best.data());
                    Eigen::Map<Eigen::Matrix<double, kPolarisability, 1>>{best.data() + 3} = trial.polarisability;
                }
            }
        }
    }
    return best;
}

/// Unknowns of the fit, and fits with a growing number of dipoles.
class SurroundingsSearch {
public:
    SurroundingsSearch(const field::GeneralDipole<double>& coils, const SurroundingsData& data)
        : coils_(coils), data_(data), frame_(data.frame), mount_(data.mount), turns_(data.poses.size()) {}

    /// Dipoles of the quadratures, from these places. The data are the couplings of the coils plus the quadratures, at known
    /// poses. None if the fit does not converge.
    std::vector<VirtualDipole> fit_quadratures(const std::vector<VirtualDipole>& places) {
        relative_ = true;
        for (const VirtualDipole& dipole : places) {
            dipoles_.resize(dipoles_.size() + kDipole);
            copy_rows(dipole.position_m / kLengthUnit_m, &dipoles_[dipoles_.size() - kDipole]);
        }
        solve(nullptr);
        return dipoles_of(dipoles_);
    }

    SurroundingsFit run() {
        solve(nullptr);
        SurroundingsFit fit;
        fit.residual_before_m = rms_m();
        double deviation = deviation_m();
        while (dipoles() < static_cast<int>(field::kMaxInducedDipoles)) {
            const Unknowns before{frame_, mount_, turns_, dipoles_};
            const DipoleBlock next = best_dipole(coils_, linearised(), clearance_m());
            dipoles_.insert(dipoles_.end(), next.begin(), next.end());
            for (int round = 0; round < 2; ++round) {  // the second with the weights at the new solution
                solve(nullptr);
            }
            if (!(deviation_m() < kWorthwhile * deviation)) {
                std::tie(frame_, mount_, turns_, dipoles_) = before;
                break;
            }
            deviation = deviation_m();
        }
        refuse_if(dipoles_.empty(),
                  "no metal found: dipoles explain the couplings no better than the coils alone ({:.3f} mm RMS); use the "
                  "calibration without surroundings",
                  1e3 * fit.residual_before_m);
        solve(std::make_unique<ceres::CauchyLoss>(loss_of(norms_m())));
        fit.residual_m = rms_m();
        fit.dipoles = dipoles_of(dipoles_);
        fit.frame = rigid_of(frame_, data_.starts.frame);
        fit.mount = rigid_of(mount_, data_.starts.mount);
        for (std::size_t k = 0; k < data_.poses.size(); ++k) {
            fit.truths.push_back(pose(k));
        }
        return fit;
    }

private:
    using Turn = std::array<double, kTurn>;
    using Unknowns = std::tuple<RigidBlock, RigidBlock, std::vector<Turn>, std::vector<double>>;

    [[nodiscard]] int dipoles() const { return static_cast<int>(dipoles_.size()) / kDipole; }

    [[nodiscard]] solver::RigidPose<double> pose(std::size_t k) const {
        return placed_pose(data_.poses[k], data_.starts, frame_.data(), mount_.data(), turns_[k].data());
    }

    [[nodiscard]] double clearance_m() const {
        double nearest = pose(0).position_m.norm();
        for (std::size_t k = 1; k < data_.poses.size(); ++k) {
            nearest = std::min(nearest, pose(k).position_m.norm());
        }
        return kClearance * nearest;
    }

    [[nodiscard]] Matrix<double, 9, 9> weight(std::size_t k) const {
        if (relative_) {
            return Matrix<double, 9, 9>::Identity() / data_.poses[k].quadrature.norm();
        }
        const auto at = pose(k);
        const double strength = data_.poses[k].x.norm() / std::sqrt(1.5);
        return pose_weight(with_surroundings(coils_, dipoles_), at, at.position_m.norm() / (3 * strength));
    }

    [[nodiscard]] std::vector<const double*> blocks(std::size_t k) const {
        return {frame_.data(), mount_.data(), turns_[k].data(), dipoles_.data()};
    }

    /// Least squares from the present values. The weights are those of the present values.
    void solve(std::unique_ptr<ceres::LossFunction> loss) {
        ceres::Problem::Options ownership;
        ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
        ceres::Problem problem(ownership);
        for (std::size_t k = 0; k < data_.poses.size(); ++k) {
            std::vector<double*> parameters{frame_.data(), mount_.data(), turns_[k].data()};
            if (!dipoles_.empty()) {
                parameters.push_back(dipoles_.data());
            }
            problem.AddResidualBlock(new SurroundingsResidual(coils_, data_.poses[k], data_.starts, weight(k), dipoles()),
                                     loss.get(), parameters);
        }
        fix_known(problem);
        keep_clear(problem);
        if (problem.NumParameterBlocks() == constant_blocks(problem)) {
            return;
        }
        const auto solver = data_.attitudes_known ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_SCHUR;
        if (const auto summary = summary_of(problem, silent_options(solver)); !summary.IsSolutionUsable()) {
            refuse_if(!relative_, "the fit of the surroundings does not converge: {}", summary.message);
            dipoles_.clear();
        }
    }

    void fix_known(ceres::Problem& problem) {
        if (data_.fixtures_known) {
            problem.SetParameterBlockConstant(frame_.data());
            problem.SetParameterBlockConstant(mount_.data());
        } else if (!data_.attitudes_known) {  // the attitudes contain the rotation of the mount
            problem.SetManifold(mount_.data(), new ceres::SubsetManifold(kRigid, {3, 4, 5}));
        }
        for (Turn& turn : turns_) {
            if (data_.attitudes_known) {
                problem.SetParameterBlockConstant(turn.data());
            }
        }
    }

    void keep_clear(ceres::Problem& problem) {
        const double least_m = clearance_m() / 2;
        for (int d = 0; d < dipoles(); ++d) {
            problem.AddResidualBlock(new Clearance(Vec3<double>::Zero(), least_m, d, dipoles()), nullptr, dipoles_.data());
            for (std::size_t k = 0; k < data_.poses.size(); ++k) {
                problem.AddResidualBlock(new Clearance(pose(k).position_m, least_m, d, dipoles()), nullptr, dipoles_.data());
            }
        }
    }

    static int constant_blocks(const ceres::Problem& problem) {
        std::vector<double*> all;
        problem.GetParameterBlocks(&all);
        return static_cast<int>(
            std::count_if(all.begin(), all.end(), [&](double* block) { return problem.IsParameterBlockConstant(block); }));
    }

    [[nodiscard]] std::vector<LinearisedPose> linearised() const {
        std::vector<LinearisedPose> all;
        for (std::size_t k = 0; k < data_.poses.size(); ++k) {
            LinearisedPose one{pose(k), weight(k), {}, {}, {}};
            Eigen::Matrix<double, 9, kRigid, Eigen::RowMajor> frame;
            Eigen::Matrix<double, 9, kRigid, Eigen::RowMajor> mount;
            Eigen::Matrix<double, 9, kTurn, Eigen::RowMajor> turn;
            std::array<double*, 4> jacobians{frame.data(), mount.data(), turn.data(), nullptr};
            const SurroundingsResidual cost(coils_, data_.poses[k], data_.starts, one.weight, dipoles());
            cost.Evaluate(blocks(k).data(), one.residual.data(), jacobians.data());
            const Index of_mount = data_.attitudes_known ? kRigid : 3;
            one.nuisance.resize(9, data_.fixtures_known ? 0 : kRigid + of_mount);
            if (!data_.fixtures_known) {
                one.nuisance << frame, mount.leftCols(of_mount);
            }
            one.own.resize(9, data_.attitudes_known ? 0 : kTurn);
            if (!data_.attitudes_known) {
                one.own << turn;
            }
            all.push_back(one);
        }
        return all;
    }

    /// Norm of the residual of each pose.
    [[nodiscard]] std::vector<double> norms_m() const {
        std::vector<double> norms;
        for (std::size_t k = 0; k < data_.poses.size(); ++k) {
            Eigen::Matrix<double, 9, 1> residual;
            const SurroundingsResidual cost(coils_, data_.poses[k], data_.starts, weight(k), dipoles());
            cost.Evaluate(blocks(k).data(), residual.data(), nullptr);
            norms.push_back(residual.norm());
        }
        return norms;
    }

    [[nodiscard]] double sum_of_squares() const {
        double sum = 0;
        for (const double norm : norms_m()) {
            sum += norm * norm;
        }
        return sum;
    }

    [[nodiscard]] double rms_m() const { return std::sqrt(sum_of_squares() / static_cast<double>(data_.poses.size())); }

    /// Standard deviation of a residual, corrected for the number of unknowns.
    [[nodiscard]] double deviation_m() const {
        const auto poses = static_cast<double>(data_.poses.size());
        const double shared = data_.fixtures_known ? 0 : (data_.attitudes_known ? 2 * kRigid : kRigid + 3);
        const double own = data_.attitudes_known ? 0 : kTurn;
        return std::sqrt(sum_of_squares() / ((9 - own) * poses - shared - static_cast<double>(dipoles_.size())));
    }

    const field::GeneralDipole<double>& coils_;
    const SurroundingsData& data_;
    RigidBlock frame_;
    RigidBlock mount_;
    std::vector<Turn> turns_;
    std::vector<double> dipoles_;  // kDipole numbers each
    bool relative_ = false;        // residuals relative to the quadrature of their pose, not metres
};

/// Fits the quadratures, each pose relative to its own.
void add_quadratures(const field::GeneralDipole<double>& coils, const SurroundingsData& data, SurroundingsFit& fit) {
    constexpr double kDeviationPerMedian = 1.4826;  // of a normal distribution
    constexpr double kLargestDeviation = 0.15;      // noise, or metal without a quadrature of its own
    SurroundingsData at_truths;
    for (std::size_t k = 0; k < fit.truths.size(); ++k) {
        const auto& [position_m, q] = fit.truths[k];
        const Mat3<double>& quadrature = data.poses[k].quadrature;
        const Mat3<double> o = q.toRotationMatrix().transpose();
        if (quadrature.isZero(0)) {
            return;
        }
        at_truths.poses.push_back(
            {position_m, o.transpose(), field::signal_matrix(coils, position_m, o) + quadrature, quadrature});
    }
    const auto dipoles = SurroundingsSearch(coils, at_truths).fit_quadratures(fit.dipoles);
    std::vector<double> off;
    for (const PlacedCouplings& pose : at_truths.poses) {
        const Mat3<double> model =
            field::induced_couplings<double>(coils, induced_by(coils, dipoles), pose.place_m, pose.rotation.transpose());
        off.push_back(std::abs(model.cwiseProduct(pose.quadrature).sum() / model.squaredNorm() - 1));
    }
    if (const double deviation = kDeviationPerMedian * median(off); deviation < kLargestDeviation) {
        fit.quadrature = dipoles;
        fit.quadrature_deviation = deviation;
    }
}

}  // namespace

SurroundingsFit fit_surroundings(const field::GeneralDipole<double>& coils, const SurroundingsData& data) {
    check_places(data.poses);
    SurroundingsFit fit = SurroundingsSearch(coils, data).run();
    add_quadratures(coils, data, fit);
    return fit;
}

}  // namespace tricoil::host
