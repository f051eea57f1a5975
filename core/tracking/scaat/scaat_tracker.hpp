// SCAAT method for ideal triads, or for coils that a CoilCorrection makes ideal.
#pragma once

#include "core/tracking/scaat/filter.hpp"

namespace tricoil::tracking {

template <typename Scalar>
class ScaatTracker final : public scaat::Filter<Scalar, scaat::ConcentricMeasurement<Scalar>> {
    using Filter = scaat::Filter<Scalar, scaat::ConcentricMeasurement<Scalar>>;

public:
    /// `params` must pass check() and hold ScaatParams.
    explicit ScaatTracker(const TrackerParams<Scalar>& params,
                          const typename Tracker<Scalar>::Correction& correction = std::nullopt)
        : Filter(params.common, *std::get_if<ScaatParams<Scalar>>(&params.method),
                 {Tracker<Scalar>::corrected(params.common, correction).coupling_constant}, correction) {}
};

extern template class scaat::Filter<float, scaat::ConcentricMeasurement<float>>;
extern template class scaat::Filter<double, scaat::ConcentricMeasurement<double>>;
static_assert(sizeof(ScaatTracker<float>) <= 3416, "four filters in float must leave room in 40 KiB of RAM");

}  // namespace tricoil::tracking
