// AnyTracker::check in its own file: programs that only check settings do not link the trackers.
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::tracking {

Status AnyTracker::check(const TrackerParams<double>& params, const Calibration& coils) {
    Status status = tracking::check(params);
    if (!status.ok() || !coils) {
        return status;
    }
    status = calibration::check(*coils);
    if (status.ok() && !std::holds_alternative<ScaatParams<double>>(params.method)) {
        const auto correction = calibration::CoilCorrection<double>::ideal_triads(*coils);
        status = correction.status();
        if (status.ok()) {
            const auto check_it = [&]<typename Params>(const Params&) -> Status {
                if constexpr (requires { TrackerOf<Params>::check(*correction); }) {  // some cannot use every correction
                    return TrackerOf<Params>::check(*correction);
                }
                return {};
            };
            status = std::visit(check_it, params.method);
        }
    }
    return status;
}

}  // namespace tricoil::tracking
