// Admission of a column, common to all trackers.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "core/signal/column.hpp"
#include "core/tracking/front/time_base.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking {

/// Columns with these flags contain no information on the couplings.
constexpr ColumnFlags kUnusable{ColumnFlag::no_reference, ColumnFlag::saturated, ColumnFlag::clipped,     ColumnFlag::stuck,
                                ColumnFlag::overrun,      ColumnFlag::dc_offset, ColumnFlag::gain_changed};

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

/// Result of admit().
struct Admission {
    std::optional<Rejection> rejection;
    bool is_late = false;        // older than the newest column, but usable
    bool has_restarted = false;  // the device clock restarted: stored times are invalid
};

/// Checks fields and time stamp of a column of one sensor.
template <typename Scalar>
Admission admit(const Column<Scalar>& column, TimeBase& time_base) {
    if (const auto reason = invalid_field(column)) {
        return {reason};
    }
    switch (time_base.take(coil_index(column.state), column.midpoint)) {
        case TimeBase::Verdict::in_order:
            break;
        case TimeBase::Verdict::late:
            return {std::nullopt, true};
        case TimeBase::Verdict::restarted:
            return {std::nullopt, false, true};
        case TimeBase::Verdict::duplicate:
            return {Rejection::duplicate};
        case TimeBase::Verdict::time_backwards:
            return {Rejection::time_backwards};
        case TimeBase::Verdict::time_ahead:
            return {Rejection::time_ahead};
    }
    return {};
}

}  // namespace tricoil::tracking
