// Previous-measurement technique (8)-(18): linearise about the previous pose, compute six increments, add them.
#pragma once

#include "core/base/status.hpp"
#include "core/geometry/angles.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::solver {

/// Range and the five small angles of one measurement in the tracking frame, (15) and (16).
template <typename Scalar>
struct TrackingIncrements {
    Scalar range_m;             // rho~
    Scalar position_azimuth;    // a0, rad
    Scalar position_elevation;  // b0, rad
    Vec3<Scalar> rotation;      // (phi0, theta0, psi0), rad: a passive small rotation about the tracking frame's x, y, z
    Scalar mean_roll;           // phi0 as the mean of the two forms of (16), rad; `rotation` has the first form
};

/// Angle form: six angles and lengths of the paper. Singular where |beta| or |theta| is a quarter turn.
template <typename Scalar>
struct AnglePose {
    geometry::Spherical<Scalar> position;
    geometry::Euler<Scalar> attitude;
};

/// Pole-free form: range, unit vector and attitude matrix O. Defined everywhere.
template <typename Scalar>
struct VectorPose {
    Scalar range_m = 1;
    Vec3<Scalar> direction = Vec3<Scalar>::UnitX();
    Mat3<Scalar> attitude = Mat3<Scalar>::Identity();
};

/// (15) with W11, and (16), from W = P^ O^^T X P^^T; the factor P^^T is (8), O^^T is (9) and P^ is (10).
/// Errors: not_finite; not_converged if W11 <= 0: the previous pose is wrong by more than 54.7 degrees.
template <typename Scalar>
Result<TrackingIncrements<Scalar>> tracking_increments(const Mat3<Scalar>& w, Scalar coupling_constant);

/// (17), (18) and (13): converts tracking-frame increments to source-frame angles and adds them to the previous ones.
/// Errors: not_converged (a previous pose exactly on a pole).
template <typename Scalar>
Result<AnglePose<Scalar>> add_increments(const AnglePose<Scalar>& previous, const TrackingIncrements<Scalar>& step);

/// One measurement by (15)-(18) in angles. `passes` > 1 repeats the step on the same X from its own result.
/// Angles are not wrapped, as in the paper, so they contain full turns.
/// Errors: not_finite, not_converged (as above, or a previous pose exactly on a pole).
template <typename Scalar>
Result<AnglePose<Scalar>> step_angles(const Mat3<Scalar>& x, Scalar coupling_constant, const AnglePose<Scalar>& previous,
                                      int passes = 1);

/// One measurement with small rotations of u and O in place of (17), (18): equal to first order, without a pole.
/// Errors: those of tracking_increments().
template <typename Scalar>
Result<VectorPose<Scalar>> step_vectors(const Mat3<Scalar>& x, Scalar coupling_constant, const VectorPose<Scalar>& previous,
                                        int passes = 1);

}  // namespace tricoil::solver
