// One pose of a calibration set against the model, in the units that matter: the error of the pose it would cause.
#pragma once

#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <array>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fixtures.hpp"

namespace tricoil::host {

constexpr int kRigid = 6;  // translation (units of 0.1 m), rotation vector (rad) on top of the start's rotation
using RigidBlock = std::array<double, kRigid>;

constexpr double kLever_m = 0.1;      // a rad counts as much as this length: a hand's breadth, a stylus
constexpr double kMisfitShare = 0.5;  // weight of what no pose explains, against what moves the pose

template <typename T>
Mat3<T> rotation_of(const T* vector) {
    Mat3<T> rotation;
    ceres::AngleAxisToRotationMatrix(vector, ceres::ColumnMajorAdapter3x3(rotation.data()));
    return rotation;
}

template <typename T>
Vec3<T> length_of(const T* p) {
    return Vec3<T>(p[0], p[1], p[2]) * T(kLengthUnit_m);
}

/// Couplings of one pose against the model, as metres.
/// Sensor frame to mount: d + N W (j + J .), with the named rotation N, the fixture's own (d, W) and the jig's common (j, J).
struct PoseResidual {
    const MeasuredPose& pose;
    Mat3<double> source_start;  // rotation stage -> source that the source block turns on
    Mat3<double> named;         // N
    Mat3<double> jig_start;     // rotation that the jig block turns on
    double coupling_constant;
    Eigen::Matrix<double, 9, 9> weight;  // metres per coupling unit, see pose_weight
    bool finite;

    template <typename T>
    bool operator()(const T* magnetic, const T* source, const T* fixture, const T* jig, T* residual) const {
        const auto model = model_of<T>(magnetic, coupling_constant);
        const Mat3<T> stage_source = rotation_of(source + 3) * source_start.cast<T>();
        const Mat3<T> fixture_rotation = named.cast<T>() * rotation_of(fixture + 3);
        const Vec3<T> mount = length_of(fixture) + fixture_rotation * length_of(jig);
        const Mat3<T> turned = stage_source * pose.stage_rotation.cast<T>();
        const Vec3<T> position = length_of(source) + stage_source * pose.stage_position_m.cast<T>() + turned * mount;
        const Mat3<T> o_transposed = turned * fixture_rotation * rotation_of(jig + 3) * jig_start.cast<T>();
        const Mat3<T> o = o_transposed.transpose();
        const Mat3<T> x = couplings<T>(model, position, o, finite);
        Eigen::Matrix<T, 9, 1> difference;
        for (int k = 0; k < 9; ++k) {
            difference(k) = x(k) - T(pose.x(k));
        }
        Eigen::Map<Eigen::Matrix<T, 9, 1>>(residual, 9) = weight.cast<T>() * difference;
        return true;
    }
};

/// What matters in the end is the pose: couplings' differences as the position and rotation that they would be taken for (J+),
/// and with less weight what no pose explains. Symmetric root of J+^T diag(1, lever^2) J+ + share^2 metres^2 (I - J J+).
inline Eigen::Matrix<double, 9, 9> pose_weight(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose,
                                               double metres) {
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    Eigen::Matrix<double, 9, 6> jacobian = field::signal_model<double>(model, pose.position_m, o).jacobian;
    jacobian.rightCols<3>() /= kLever_m;
    const Mat6<double> inverse = (jacobian.transpose() * jacobian).inverse();
    const Eigen::Matrix<double, 6, 9> pseudo = inverse * jacobian.transpose();
    Eigen::Matrix<double, 9, 9> square = pseudo.transpose() * pseudo;
    const double share = kMisfitShare * metres;
    square += share * share * (Eigen::Matrix<double, 9, 9>::Identity() - jacobian * pseudo);
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>>(square).operatorSqrt();
}

}  // namespace tricoil::host
