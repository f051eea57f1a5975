// Admission of a column, common to all trackers.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "core/signal/column.hpp"
#include "core/tracking/front/time_base.hpp"

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

/// Checks fields and time stamp of a column of one sensor.
template <typename Scalar>
Admission admit(const Column<Scalar>& column, TimeBase& time_base) {
    if (const auto reason = invalid_field(column)) {
        return {reason};
    }
    return time_base.take(coil_index(column.state), column.midpoint);
}

}  // namespace tricoil::tracking
