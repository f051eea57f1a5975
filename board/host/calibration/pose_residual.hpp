// Residual of one calibration pose, weighted as pose error, and its derivatives.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <array>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fixtures.hpp"

namespace ceres {
class Problem;
}

namespace tricoil::host {

constexpr int kRigid = 6;  // translation (units of 0.1 m), rotation vector (rad) relative to the start rotation
using RigidBlock = std::array<double, kRigid>;

Mat3<double> rotation_of(const double* vector);

/// J(w) with exp(w + dw) = exp(J(w) dw) exp(w) to first order: the left Jacobian of the rotation group.
Mat3<double> left_jacobian(const double* vector);

/// Block of a translation, without rotation.
inline RigidBlock rigid_block(const Vec3<double>& translation_m) {
    RigidBlock block{};
    copy_rows(translation_m / kLengthUnit_m, block.data());
    return block;
}

inline Vec3<double> length_of(const double* p) { return Vec3<double>(p[0], p[1], p[2]) * kLengthUnit_m; }

/// Transform of a block, from its start rotation.
inline Rigid rigid_of(const RigidBlock& block, const Mat3<double>& start) {
    return {rotation_of(block.data() + 3) * start, length_of(block.data())};
}

/// Symmetric root of J+^T diag(1, lever^2) J+ + share^2 metres^2 (I - J J+). Weights coupling residuals as the position and
/// rotation error that they cause (J+), and the part that no pose explains with `share`. metres: metres per coupling unit.
Matrix<double, 9, 9> pose_weight(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose, double metres);

/// Weight of the couplings of one pose, metres per coupling unit: a coupling decreases by 3 k / rho per metre.
double metres_per_coupling(const Mat3<double>& x, double coupling_constant);

/// Only the first `free` magnetic parameters vary.
void hold_parameters(ceres::Problem& problem, double* magnetic, int free);

/// Constants of the residual of one pose. Sensor frame to mount: d + N W (j + J .), with named rotation N, fixture (d, W) and
/// common jig (j, J).
struct PoseTerms {
    const MeasuredPose& pose;
    Mat3<double> source_start;  // start rotation, stage to source, of the source block
    Mat3<double> named;         // N
    Mat3<double> jig_start;     // start rotation of the jig block
    double coupling_constant;
    Matrix<double, 9, 9> weight;  // metres per coupling unit, see pose_weight
    bool finite;                  // the coils have octupoles
};

/// Weighted coupling residual (model minus measured) of one pose, m. Parameter blocks: magnetic, source, fixture, jig, stage,
/// pick-up.
class PoseResidual final : public ceres::SizedCostFunction<9, kMagnetic, kRigid, kRigid, kRigid, kStage, kPickUp> {
public:
    explicit PoseResidual(const PoseTerms& terms) : terms_(terms) {}

    bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

private:
    PoseTerms terms_;
};

}  // namespace tricoil::host
