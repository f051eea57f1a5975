// Previous-measurement technique: each signal matrix changes the last pose by small increments.
#pragma once

#include "core/tracking/matrix/matrix_tracker.hpp"

namespace tricoil::tracking {

template <typename Scalar>
class PreviousTracker final : public MatrixTracker<Scalar> {
    using typename MatrixTracker<Scalar>::Pose;
    using typename Tracker<Scalar>::Correction;

public:
    /// `params` must pass check() and hold PreviousParams.
    explicit PreviousTracker(const TrackerParams<Scalar>& params, const Correction& correction = std::nullopt);

private:
    Result<Pose> do_step(const Mat3<Scalar>& x, const Pose& last) override;

    int passes_;
};

extern template class PreviousTracker<float>;
extern template class PreviousTracker<double>;

}  // namespace tricoil::tracking
