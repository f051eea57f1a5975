// Pose of one sensor coil in the field of a generator of N coils: five degrees of freedom. The rotation about the axis of the
// coil has no effect on the couplings and stays unknown.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/base/status.hpp"
#include "core/field/generator.hpp"

namespace tricoil::solver {

template <typename Scalar>
struct SingleCoilPose {
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();   // generator frame
    Vec3<Scalar> sensitivity = Vec3<Scalar>::Zero();  // gain times axis, generator frame
};

template <typename Scalar>
struct SingleCoilParams {
    Scalar gain = 0;                           // of the sensor coil; zero: unknown, estimated
    Scalar gain_deviation = Scalar(2e-3);      // standard deviation of a known gain, relative
    std::optional<Vec3<Scalar>> start_m;       // a position near the sensor; empty: unknown
    Vec3<Scalar> side = Vec3<Scalar>::Zero();  // from the middle of the coils to the half space of the sensor; zero: unknown
    int max_iterations = 40;                   // trial steps of one start
    Scalar step_tolerance = Scalar(1e-4);      // relative to the distance from the nearest source coil; convergence is quadratic
    Scalar max_step = Scalar(0.4);             // of one step, relative to the same distance
    Scalar max_misfit_share = Scalar(0);       // misfit that the generator's calibration leaves, relative to the couplings (norm)
    Scalar max_deviation_share = Scalar(0.1);  // of position (relative to the distance) and axis
};

enum class SingleCoilEnd : std::uint8_t {
    converged,
    not_converged,  // steps were still large
    wrong_minimum,  // the generator's field does not explain the couplings at the final pose
    undetermined,   // the couplings do not determine the pose: too much noise, or a sensor in the plane of flat source coils
    ambiguous,      // another pose explains the couplings too; the side is needed
};

template <typename Scalar>
struct SingleCoilSolution {
    SingleCoilPose<Scalar> pose;
    SingleCoilEnd end = SingleCoilEnd::not_converged;
    int iterations = 0;
    Scalar chi_square = 0;      // with N - 6 degrees of freedom, N - 5 with a known gain
    Scalar gain_deviation = 0;  // of the estimated gain, relative
    /// (position, axis), generator frame. The axis is a unit vector: its variance along itself is zero.
    Mat6<Scalar> covariance = Mat6<Scalar>::Zero();

    [[nodiscard]] bool converged() const { return end == SingleCoilEnd::converged; }
};

/// Of all coils of the generator. weight: 1 / sigma, zero for a coil that is not used.
template <typename Scalar>
struct CoilCouplings {
    std::span<const Scalar> value;
    std::span<const Scalar> weight;
};

/// Minimises the sum over i of (weight_i (n.B_i(p) - c_i))^2, with a known gain also ((|n| - gain) / deviation)^2. For each p, n
/// is a linear least-squares solution (variable projection, Golub and Pereyra 1973): steps have three parameters. No heap.
/// Without a start it refines the best of a grid around the generator, and keeps the least misfit. A second minimum that noise
/// does not distinguish makes the pose `ambiguous`: flat coils in one plane have equal fields on both sides of it. Errors:
/// invalid_argument (sizes, fewer equations than unknowns, gain), not_finite, degenerate (couplings zero).
template <typename Scalar>
Result<SingleCoilSolution<Scalar>> solve_single_coil(const field::Generator<Scalar>& generator,
                                                     const CoilCouplings<Scalar>& measured,
                                                     const SingleCoilParams<Scalar>& params = {});

}  // namespace tricoil::solver
