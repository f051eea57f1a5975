// Check for unusable columns, common to all trackers.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "core/signal/column.hpp"
#include "core/tracking/time_base.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking {

/// Reason why a column cannot be used: state is not s1-s3; couplings or their squares are not finite; sigma is not positive or
/// its square is out of range of the scalar type (float: sigma 1e-19 to 1e19). All trackers compute squares.
template <typename Scalar>
std::optional<Rejection> invalid_field(const Column<Scalar>& column) {
    if (coil_index(column.state) < 0) {
        return Rejection::unknown_state;
    }
    if (!std::isfinite(column.in_phase.squaredNorm()) || !std::isfinite(column.quadrature.squaredNorm())) {
        return Rejection::not_finite;
    }
    const Vec3<Scalar> variance = column.sigma.cwiseAbs2();
    if (!(column.sigma.minCoeff() > 0) || !(variance.minCoeff() >= std::numeric_limits<Scalar>::min()) ||
        !std::isfinite(variance.sum())) {
        return Rejection::bad_sigma;
    }
    return std::nullopt;
}

/// Reason for which a verdict refuses a column; nullopt if it accepts the column.
constexpr std::optional<Rejection> reason_of(TimeBase::Verdict verdict) {
    switch (verdict) {
        case TimeBase::Verdict::in_order:
        case TimeBase::Verdict::late:
        case TimeBase::Verdict::restarted:
            break;
        case TimeBase::Verdict::duplicate:
            return Rejection::duplicate;
        case TimeBase::Verdict::time_backwards:
            return Rejection::time_backwards;
        case TimeBase::Verdict::time_ahead:
            return Rejection::time_ahead;
    }
    return std::nullopt;
}

}  // namespace tricoil::tracking
