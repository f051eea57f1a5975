// Residual of one pose near metal at rest, weighted as pose error, and its derivatives.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "board/host/calibration/pose_residual.hpp"
#include "board/support/calibration_file.hpp"

namespace tricoil::host {

/// Parameters of a virtual dipole: position (units of 0.1 m), polarisability xx, yy, zz, xy, xz, yz (units of 0.001 m^3).
constexpr int kDipole = 9;
constexpr double kPolarisabilityUnit_m3 = 1e-3;
constexpr int kTurn = 3;  // rotation vector of the attitude of one pose, rad

VirtualDipole dipole_of(const double* p);
std::vector<VirtualDipole> dipoles_of(std::span<const double> p);

/// The coils with the virtual dipoles of `p`, kDipole numbers each.
field::GeneralDipole<double> with_surroundings(const field::GeneralDipole<double>& coils, std::span<const double> p);

/// Couplings at a place of a stage or a grid. The sensor is at frame + F (place + R mount) and has the attitude F R M, with the
/// rotations F and M of the blocks `frame` and `mount`, and R = exp(turn) rotation.
struct PlacedCouplings {
    Vec3<double> place_m;
    Mat3<double> rotation;  // mount to stage, or the start value of the attitude in the grid's frame
    Mat3<double> x;
    Mat3<double> quadrature = Mat3<double>::Zero();  // zero: unknown
};

/// Start rotations of the blocks; the blocks contain rotation vectors relative to them.
struct FrameStarts {
    Mat3<double> frame = Mat3<double>::Identity();
    Mat3<double> mount = Mat3<double>::Identity();
};

/// Pose of the sensor with these blocks.
solver::RigidPose<double> placed_pose(const PlacedCouplings& placed, const FrameStarts& starts, const double* frame,
                                      const double* mount, const double* turn);

/// Weighted coupling residual (model minus measured), m. Parameter blocks: frame, mount, turn, and the dipoles if there are any.
class SurroundingsResidual final : public ceres::CostFunction {
public:
    /// All arguments must outlive this object. weight: metres per coupling unit, see pose_weight.
    SurroundingsResidual(const field::GeneralDipole<double>& coils, const PlacedCouplings& placed, const FrameStarts& starts,
                         const Matrix<double, 9, 9>& weight, int dipoles);

    bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

private:
    const field::GeneralDipole<double>& coils_;
    const PlacedCouplings& placed_;
    const FrameStarts& starts_;
    Matrix<double, 9, 9> weight_;
    int dipoles_;
};

/// Derivatives of the couplings (column order) with respect to the parameters of one virtual dipole. o: source components to
/// sensor components.
Matrix<double, 9, kDipole> dipole_derivatives(const field::GeneralDipole<double>& coils, const VirtualDipole& dipole,
                                              const Vec3<double>& position_m, const Mat3<double>& o);

}  // namespace tricoil::host
