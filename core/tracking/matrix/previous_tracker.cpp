#include "core/tracking/matrix/previous_tracker.hpp"

#include "core/base/precision.hpp"

namespace tricoil::tracking {
namespace {

template <typename Scalar>
solver::AnglePose<Scalar> to_angles(const solver::VectorPose<Scalar>& pose) {
    return {geometry::to_spherical<Scalar>(pose.range_m * pose.direction), geometry::to_euler(pose.attitude)};
}

template <typename Scalar>
solver::VectorPose<Scalar> to_vectors(const solver::AnglePose<Scalar>& pose) {
    return {pose.position.range_m, geometry::direction(pose.position.azimuth_rad, pose.position.elevation_rad),
            geometry::attitude_matrix(pose.attitude)};
}

error_model::SolverForm solver_form(PreviousParams::Form form) {
    return form == PreviousParams::Form::angles ? error_model::SolverForm::previous_angles
                                                : error_model::SolverForm::previous_vectors;
}

}  // namespace

template <typename Scalar>
PreviousTracker<Scalar>::PreviousTracker(const TrackerParams<Scalar>& params, const Correction& correction)
    : MatrixTracker<Scalar>(
          params.common, std::get_if<PreviousParams>(&params.method)->deskew,
          {solver_form(std::get_if<PreviousParams>(&params.method)->form), std::get_if<PreviousParams>(&params.method)->passes},
          correction),
      method_(*std::get_if<PreviousParams>(&params.method)) {}

template <typename Scalar>
auto PreviousTracker<Scalar>::do_step(const Mat3<Scalar>& x, const Pose& last) -> Result<Pose> {
    if (method_.form == PreviousParams::Form::vectors) {
        return solver::step_vectors(x, this->params().coupling_constant, last, method_.passes);
    }
    const auto stepped = solver::step_angles(x, this->params().coupling_constant, last_angles_, method_.passes);
    if (!stepped.ok()) {
        return stepped.status();
    }
    next_angles_ = *stepped;
    return to_vectors(*stepped);
}

template <typename Scalar>
void PreviousTracker<Scalar>::do_follow(const Pose& pose, bool is_step) {
    if (method_.form == PreviousParams::Form::angles) {
        last_angles_ = is_step ? next_angles_ : to_angles(pose);
    }
}

#if TRICOIL_FLOAT_TRACKERS
template class PreviousTracker<float>;
#endif
#if TRICOIL_DOUBLE
template class PreviousTracker<double>;
#endif

}  // namespace tricoil::tracking
