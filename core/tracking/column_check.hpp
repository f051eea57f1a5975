// Columns that are no measurement, whatever the time: one answer for all trackers.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "core/signal/column.hpp"
#include "core/tracking/time_base.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking {

/// Why a column cannot be used: not one of s1-s3; couplings that are not finite or whose squares are not; sigma not positive, or
/// with a square that the scalar type does not hold (float: 1e-19 to 1e19). Every tracker works with squares.
template <typename Scalar>
std::optional<Rejection> why_unusable(const Column<Scalar>& column) {
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

/// The reason for which a verdict refuses; nothing if it does not.
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
