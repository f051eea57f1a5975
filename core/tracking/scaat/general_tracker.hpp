// SCAAT method for real coils, with positions, moments and sizes from their calibration.
#pragma once

#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/scaat/general_measurement.hpp"

namespace tricoil::tracking {

template <typename Scalar>
class GeneralTracker final : public scaat::Filter<Scalar, scaat::GeneralMeasurement<Scalar>> {
    using Filter = scaat::Filter<Scalar, scaat::GeneralMeasurement<Scalar>>;

public:
    /// `params` must pass check() and hold ScaatParams; `coils` must pass calibration::check().
    GeneralTracker(const TrackerParams<Scalar>& params, const calibration::Calibration<Scalar>& coils)
        : Filter(params.common, *std::get_if<ScaatParams<Scalar>>(&params.method), {coils.model},
                 calibration::CoilCorrection<Scalar>::phases(coils)) {}
};

extern template class scaat::Filter<float, scaat::GeneralMeasurement<float>>;
extern template class scaat::Filter<double, scaat::GeneralMeasurement<double>>;

}  // namespace tricoil::tracking
