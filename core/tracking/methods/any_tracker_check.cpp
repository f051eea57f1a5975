// AnyTracker::check in its own file: programs that only check settings do not link the trackers.
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::tracking {

/// Some trackers cannot use every correction.
template <typename Scalar, typename Params>
static Status check_correction(const Params& /*method*/, const calibration::CoilCorrection<Scalar>& correction) {
    if constexpr (requires { TrackerOf<Scalar, Params>::check(correction); }) {
        return TrackerOf<Scalar, Params>::check(correction);
    } else {
        return {};
    }
}

template <typename Scalar>
Status AnyTracker<Scalar>::check(const TrackerParams<Scalar>& params, const Calibration& coils) {
    Status status = tracking::check(params);
    if (!status.ok() || !coils) {
        return status;
    }
    status = calibration::check(*coils);
    if (status.ok() && !std::holds_alternative<ScaatParams<Scalar>>(params.method)) {
        const auto correction = calibration::CoilCorrection<Scalar>::ideal_triads(*coils);
        status = correction.status();
        if (status.ok()) {
            status = std::visit([&](const auto& method) { return check_correction<Scalar>(method, *correction); }, params.method);
        }
    }
    return status;
}

template Status AnyTracker<double>::check(const TrackerParams<double>& params, const Calibration& coils);

}  // namespace tricoil::tracking
