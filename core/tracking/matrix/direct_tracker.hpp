// Direct method: closed-form maximum-likelihood pose of each signal matrix.
#pragma once

#include "core/tracking/matrix/matrix_tracker.hpp"

namespace tricoil::tracking {

template <typename Scalar>
class DirectTracker final : public MatrixTracker<Scalar> {
public:
    using typename Tracker<Scalar>::Correction;
    /// `params` must pass check() and hold DirectParams.
    explicit DirectTracker(const TrackerParams<Scalar>& params, const Correction& correction = std::nullopt)
        : MatrixTracker<Scalar>(params.common, std::get_if<DirectParams>(&params.method)->deskew, {}, correction) {}
};

static_assert(sizeof(DirectTracker<float>) <= 2544, "size of a tracker in float without a filter");

}  // namespace tricoil::tracking
