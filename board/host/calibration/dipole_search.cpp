#include "board/host/calibration/dipole_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

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

}  // namespace

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

}  // namespace tricoil::host
