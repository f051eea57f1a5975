#include "core/tracking/matrix/previous_tracker.hpp"

#include "core/base/precision.hpp"

namespace tricoil::tracking {

template <typename Scalar>
PreviousTracker<Scalar>::PreviousTracker(const TrackerParams<Scalar>& params, const Correction& correction)
    : MatrixTracker<Scalar>(params.common, std::get_if<PreviousParams>(&params.method)->deskew,
                            {error_model::SolverForm::previous_vectors, std::get_if<PreviousParams>(&params.method)->passes},
                            correction),
      passes_(std::get_if<PreviousParams>(&params.method)->passes) {}

template <typename Scalar>
auto PreviousTracker<Scalar>::do_step(const Mat3<Scalar>& x, const Pose& last) -> Result<Pose> {
    return solver::step_vectors(x, this->params().coupling_constant, last, passes_);
}

#if TRICOIL_FLOAT_TRACKERS
template class PreviousTracker<float>;
#endif
#if TRICOIL_DOUBLE
template class PreviousTracker<double>;
#endif

}  // namespace tricoil::tracking
