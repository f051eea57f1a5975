// Deskew: extrapolates the columns of one signal matrix to one time, each from the last two of its excitation state.
#pragma once

#include "core/signal/column.hpp"

namespace tricoil::tracking {

/// Couplings of a column at another time than its own.
template <typename Scalar>
struct DeskewedColumn {
    Vec3<Scalar> in_phase;
    Scalar variance_factor;  // factor of the noise variance: (1 + a)^2 + a^2
    DeviceTime time;         // of in_phase
};

/// Linear extrapolation of `latest` to `time` with the slope from `before`, the column of the same state one frame earlier.
/// Returns `latest` itself if `before` is missing or its age is not within (0, longest_gap]. A column extrapolated by the share a
/// of the frame T has an error of (a + a^2) T^2 X''/2.
template <typename Scalar>
DeskewedColumn<Scalar> deskew(const Column<Scalar>& before, const Column<Scalar>& latest, DeviceTime time,
                              Microseconds longest_gap) {
    const Microseconds gap = latest.midpoint - before.midpoint;
    if (before.state != latest.state || gap.count() <= 0 || gap > longest_gap) {
        return {latest.in_phase, Scalar(1), latest.midpoint};
    }
    const Scalar a = seconds_as<Scalar>(time - latest.midpoint) / seconds_as<Scalar>(gap);
    return {latest.in_phase + a * (latest.in_phase - before.in_phase), (1 + a) * (1 + a) + a * a, time};
}

}  // namespace tricoil::tracking
