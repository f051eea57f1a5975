// Fit of a pose to a signal matrix, in integers.
#pragma once

#include "core/fixed/previous_measurement.hpp"

namespace tricoil::fixed {

struct ModelFit {
    Scaled strength;        // k = C / range^3, coupling units
    Scaled misfit_squared;  // |X - k O D(u)|^2, coupling units squared
    Unit misfit_share;      // misfit_squared relative to |X|^2; saturates at two
    bool right_handed;      // det X > 0
};

/// x is not zero; pose.range_m and coupling_constant are positive.
ModelFit fit_of(const NormalisedBlock& x, Scaled coupling_constant, const VectorPose& pose);

}  // namespace tricoil::fixed
