// Iterative least-squares solvers for comparison with the closed form; both use analytic Jacobians and a given start.
#pragma once

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::bench {

struct SolvedPose {
    Vec3<double> position_m;
    Quat<double> q_source_sensor;
};

/// Residuals of X with C = 1 at `start` displaced by d = (position, small rotation in the source frame).
struct Problem {
    Mat3<double> x;
    SolvedPose start;

    [[nodiscard]] SolvedPose at(const Vec6<double>& d) const {
        return {start.position_m + d.head<3>(),
                geometry::rotation_vector_to_quaternion<double>(d.tail<3>()) * start.q_source_sensor};
    }
    [[nodiscard]] Matrix<double, 9, 1> residuals(const Vec6<double>& d) const {
        const SolvedPose pose = at(d);
        return (field::signal_matrix<double>(1.0, pose.position_m, geometry::attitude_matrix(pose.q_source_sensor)) - x)
            .reshaped();
    }
    /// Derivative with respect to d. Exact for small rotations in d (here about 1e-3, because the start is the truth).
    [[nodiscard]] Matrix<double, 9, 6> jacobian(const Vec6<double>& d) const {
        const SolvedPose pose = at(d);
        return field::signal_matrix_jacobian<double>(1.0, pose.position_m, geometry::attitude_matrix(pose.q_source_sensor));
    }
};

/// Eigen's unsupported Levenberg-Marquardt.
SolvedPose solve_levenberg_marquardt(const Problem& problem);

/// Ceres, dense QR, function tolerance 1e-12.
SolvedPose solve_ceres(const Problem& problem);

}  // namespace tricoil::bench
