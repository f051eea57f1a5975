// Refined solver: pose from one signal matrix of real coils by Levenberg-Marquardt on six parameters. Needs a start pose.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"
#include "core/field/general_dipole.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::solver {

/// Position and attitude of the sensor frame.
template <typename Scalar>
struct RigidPose {
    Vec3<Scalar> position_m = Vec3<Scalar>::UnitX();  // source frame
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();
};

template <typename Scalar>
struct RefineParams {
    int max_iterations = 20;  // trial steps, accepted or not
    /// Of a step, relative to the range and in rad. Convergence is quadratic: the remaining error is the square of the last step.
    Scalar step_tolerance = Scalar(1e-4);
    Scalar max_range_step = Scalar(0.35);    // of one step, relative to the range; the field falls with the third power
    Scalar max_rotation_step = Scalar(0.7);  // rad
    /// Misfit beyond noise, relative to the signal (root sum squares). A larger misfit means a wrong minimum, or a field that the
    /// model does not describe (measured: see README).
    Scalar max_misfit_share = Scalar(0.01);
    /// Chi-square allowed for noise if weights are 1 / sigma: 16.27 (three degrees of freedom) is exceeded once in 1,000 poses.
    Scalar noise_gate = 0;
    Scalar max_condition = Scalar(1e6);  // of the scaled normal matrix (about 60 for an ideal triad)
};

enum class RefineEnd : std::uint8_t {
    converged,
    iteration_limit,  // steps were still large
    wrong_minimum,    // the model does not explain the couplings at the final pose
    singular,         // the couplings do not determine six parameters here
};

/// Result of the iteration.
template <typename Scalar>
struct Minimum {
    RigidPose<Scalar> pose;
    RefineEnd end = RefineEnd::iteration_limit;
    int iterations = 0;
    Scalar condition = 0;       // of the normal matrix at the last step, with lengths relative to the range
    Scalar misfit_squared = 0;  // sum of squared weighted residuals: chi-square if the weights are 1 / sigma
    Scalar misfit_share = 0;    // root of misfit_squared relative to the squared weighted couplings

    [[nodiscard]] bool converged() const { return end == RefineEnd::converged; }
};

template <typename Scalar>
struct Refinement : Minimum<Scalar> {
    Mat6<Scalar> covariance = Mat6<Scalar>::Zero();  // (position, small rotation), source frame; valid if weights are 1 / sigma
};

/// Minimises the sum over i, j of (weight_ij (model_ij(pose) - x_ij))^2. At most max_iterations, no heap.
/// weights: 1 / sigma of each entry, finite and not negative. Equal weights of any size give the same pose, but the noise gate
/// and the covariance need 1 / sigma. Errors: not_finite (x, weights or start), degenerate (x or weights zero, or start at the
/// origin).
template <typename Scalar>
Result<Refinement<Scalar>> refine(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                  const RigidPose<Scalar>& start, const RefineParams<Scalar>& params = {});

/// The same without the covariance.
template <typename Scalar>
Result<Minimum<Scalar>> minimise(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                 const RigidPose<Scalar>& start, const RefineParams<Scalar>& params = {});

}  // namespace tricoil::solver
