// One pose of a calibration set against the model: the residual as a pose error, and its derivatives.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fixtures.hpp"

namespace tricoil::host {

constexpr int kRigid = 6;  // translation (units of 0.1 m), rotation vector (rad) on top of the start's rotation
using RigidBlock = std::array<double, kRigid>;

Mat3<double> rotation_of(const double* vector);

inline Vec3<double> length_of(const double* p) { return Vec3<double>(p[0], p[1], p[2]) * kLengthUnit_m; }

/// Symmetric root of J+^T diag(1, lever^2) J+ + share^2 metres^2 (I - J J+): weighs differences of couplings as the position and
/// rotation error that they cause (J+), and with less weight the part that no pose explains. metres: per coupling unit.
Eigen::Matrix<double, 9, 9> pose_weight(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose,
                                        double metres);

/// Constants of one pose's residual. Sensor frame to mount: d + N W (j + J .), with the named rotation N, the fixture's own
/// (d, W) and the jig's common (j, J).
struct PoseTerms {
    const MeasuredPose& pose;
    Mat3<double> source_start;  // rotation stage -> source that the source block turns on
    Mat3<double> named;         // N
    Mat3<double> jig_start;     // rotation that the jig block turns on
    double coupling_constant;
    Eigen::Matrix<double, 9, 9> weight;  // metres per coupling unit, see pose_weight
    bool finite;                         // coils have octupoles
};

/// Weighted couplings of one pose less the model's, metres. Parameter blocks: magnetic, source, fixture, jig.
class PoseResidual final : public ceres::SizedCostFunction<9, kMagnetic, kRigid, kRigid, kRigid> {
public:
    explicit PoseResidual(const PoseTerms& terms) : terms_(terms) {}

    bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

private:
    PoseTerms terms_;
};

}  // namespace tricoil::host
