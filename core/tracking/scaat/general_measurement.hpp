// Measurement model of the filter for real coils (general model).
#pragma once

#include "core/field/general_dipole.hpp"
#include "core/solver/cold_start.hpp"
#include "core/tracking/scaat/measurement_model.hpp"

namespace tricoil::tracking::scaat {

/// General model. With coil offsets X is not even in the position. If the offsets are large compared with noise and motion
/// errors, the couplings determine the hemisphere.
template <typename Scalar>
struct GeneralMeasurement {
    field::GeneralDipole<Scalar> coils;

    [[nodiscard]] static constexpr bool is_even() { return false; }

    [[nodiscard]] field::ColumnModel<Scalar> column(const Vec3<Scalar>& position_m, const Mat3<Scalar>& o, int j) const {
        return field::column_model(coils, position_m, o, j);
    }

    [[nodiscard]] Result<StartPose<Scalar>> start(const Mat3<Scalar>& x) const { return start_pose(x, search(x), false); }

    [[nodiscard]] Result<StartPose<Scalar>> near(const Mat3<Scalar>& x, const Vec3<Scalar>& position_m,
                                                 const Quat<Scalar>& q) const {
        const Result<Found> found = refine_from(x, {position_m, q});
        return found.ok() ? start_pose(x, found, true) : start(x);
    }

private:
    /// Pose that fits the couplings.
    struct Found {
        solver::RigidPose<Scalar> pose;
        Scalar misfit_squared;
        bool right_handed;
    };

    // The functions are not inlined, so that their stack use does not add up.
    [[nodiscard, gnu::noinline]] Result<Found> search(const Mat3<Scalar>& x) const {
        solver::ColdStartParams<Scalar> params;
        params.refine = tolerant();
        const auto cold = solver::solve_cold<Scalar>(coils, x, Mat3<Scalar>::Ones(), params);
        if (!cold.ok()) {
            return cold.status();
        }
        if (cold->right_handed && !cold->refinement.converged()) {
            return Status{StatusCode::not_converged, "no pose explains the couplings"};
        }
        return Found{cold->refinement.pose, cold->refinement.misfit_squared, cold->right_handed};
    }

    [[nodiscard, gnu::noinline]] Result<Found> refine_from(const Mat3<Scalar>& x, const solver::RigidPose<Scalar>& pose) const {
        const auto refined = solver::minimise<Scalar>(coils, x, Mat3<Scalar>::Ones(), pose, tolerant());
        if (!refined.ok() || !refined->converged()) {
            return Status{StatusCode::not_converged, "no pose near the start explains the couplings"};
        }
        return Found{refined->pose, refined->misfit_squared, true};
    }

    /// Limits that allow for motion between columns and for metal, whose misfit may exceed that of a wrong minimum. The filter
    /// decides whether the misfit is too large for a sensor.
    static solver::RefineParams<Scalar> tolerant() {
        solver::RefineParams<Scalar> params;
        params.max_misfit_share = Scalar(0.3);
        return params;
    }

    /// False if the mirror image fits nearly as well: the hemisphere is then unknown.
    [[nodiscard, gnu::noinline]] bool fits_better_than_mirror(const Mat3<Scalar>& x, const Found& best) const {
        constexpr Scalar kMinMisfitRatio = 9;  // of squared misfits: factor 3 in the misfit
        const auto mirror = solver::minimise<Scalar>(coils, x, Mat3<Scalar>::Ones(),
                                                     {-best.pose.position_m, best.pose.q_source_sensor}, tolerant());
        const bool elsewhere = mirror.ok() && mirror->pose.position_m.dot(best.pose.position_m) < 0;
        return !elsewhere || mirror->misfit_squared > kMinMisfitRatio * best.misfit_squared;
    }

    /// continued: the hemisphere is known by continuity. |X|^2 = 3/2 k^2 for ideal triads, by (6).
    [[nodiscard, gnu::noinline]] Result<StartPose<Scalar>> start_pose(const Mat3<Scalar>& x, const Result<Found>& found,
                                                                      bool continued) const {
        if (!found.ok()) {
            return found.status();
        }
        StartPose<Scalar> pose;
        pose.position_m = found->pose.position_m;
        pose.attitude = found->pose.q_source_sensor.toRotationMatrix().transpose();
        pose.strength = std::sqrt(x.squaredNorm() / Scalar(1.5));
        pose.misfit_squared = found->misfit_squared;
        pose.right_handed = found->right_handed;
        pose.hemisphere_from_data = continued || (found->right_handed && fits_better_than_mirror(x, *found));
        return pose;
    }
};

}  // namespace tricoil::tracking::scaat
