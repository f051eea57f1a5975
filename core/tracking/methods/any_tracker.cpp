#include "core/tracking/methods/any_tracker.hpp"

#include "core/base/assertion.hpp"

namespace tricoil::tracking {
namespace {

Tracker<double>::Correction ideal_triads(const std::optional<calibration::Calibration<double>>& coils) {
    if (!coils) {
        return std::nullopt;
    }
    const auto correction = calibration::CoilCorrection<double>::ideal_triads(*coils);
    return correction.ok() ? std::optional(*correction) : std::nullopt;
}

}  // namespace

AnyTracker::AnyTracker(const TrackerParams<double>& params, const Calibration& coils) {
    const Correction correction = ideal_triads(coils);
    if (coils && !correction) {
        tracker_ = &method_.emplace<GeneralTracker<double>>(params, *coils);
    } else {
        make(params, correction);
    }
    if (coils && !coils->surroundings_lag.dipoles.empty()) {
        change_.emplace(params.common, *coils);
    }
}

AnyTracker::AnyTracker(const TrackerParams<double>& params, const Correction& correction) { make(params, correction); }

void AnyTracker::make(const TrackerParams<double>& params, const Correction& correction) {
    TRICOIL_ASSERT(tracking::check(params).ok());
    const auto emplace = [&]<typename Params>(const Params&) {
        tracker_ = &method_.emplace<TrackerOf<Params>>(params, correction);
    };
    std::visit(emplace, params.method);
    if (const auto* bands = std::get_if<DualBandParams>(&params.method); bands != nullptr && bands->filter) {
        filter_.emplace(params.common, bands->predict_ahead);
    }
}

std::optional<scaat::FilterState<double>> AnyTracker::filter_state() const {
    if (filter_) {
        return filter_->filter_state();
    }
    if (const auto* ideal = std::get_if<ScaatTracker<double>>(&method_)) {
        return ideal->filter_state();
    }
    if (const auto* general = std::get_if<GeneralTracker<double>>(&method_)) {
        return general->filter_state();
    }
    return std::nullopt;
}

}  // namespace tricoil::tracking
