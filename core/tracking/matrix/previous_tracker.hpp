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
    explicit PreviousTracker(const TrackerParams<Scalar>& params, const Correction& correction = std::nullopt)
        : PreviousTracker(params.common, *std::get_if<PreviousParams>(&params.method), correction) {}

private:
    PreviousTracker(const CommonParams<Scalar>& common, const PreviousParams& params, const Correction& correction)
        : MatrixTracker<Scalar>(common, params.deskew, {error_model::SolverForm::previous_vectors, params.passes}, correction),
          passes_(params.passes) {}

    Result<Pose> do_step(const Mat3<Scalar>& x, const Pose& last) override {
        return solver::step_vectors(x, this->params().coupling_constant, last, passes_);
    }

    int passes_;
};

}  // namespace tricoil::tracking
