#include "core/tracking/methods/any_tracker.hpp"

#include "core/base/assertion.hpp"

namespace tricoil::tracking {
namespace {

template <typename Scalar>
typename Tracker<Scalar>::Correction ideal_triads(const std::optional<calibration::Calibration<Scalar>>& coils) {
    if (!coils) {
        return std::nullopt;
    }
    const auto correction = calibration::CoilCorrection<Scalar>::ideal_triads(*coils);
    return correction.ok() ? std::optional(*correction) : std::nullopt;
}

}  // namespace

template <typename Scalar>
AnyTracker<Scalar>::AnyTracker(const TrackerParams<Scalar>& params, const Calibration& coils) {
    const Correction correction = ideal_triads(coils);
    if (coils && !correction) {
        tracker_ = &method_.template emplace<GeneralTracker<Scalar>>(params, *coils);
    } else {
        make(params, correction);
    }
}

template <typename Scalar>
AnyTracker<Scalar>::AnyTracker(const TrackerParams<Scalar>& params, const Correction& correction) {
    make(params, correction);
}

template <typename Scalar>
void AnyTracker<Scalar>::make(const TrackerParams<Scalar>& params, const Correction& correction) {
    TRICOIL_ASSERT(tracking::check(params).ok());
    const auto emplace = [&]<typename Params>(const Params&) {
        tracker_ = &method_.template emplace<TrackerOf<Scalar, Params>>(params, correction);
    };
    std::visit(emplace, params.method);
    if (const auto* bands = std::get_if<DualBandParams>(&params.method); bands != nullptr && bands->filter) {
        filter_.emplace(params.common, bands->predict_ahead);
    }
}

template <typename Scalar>
std::optional<scaat::FilterState<Scalar>> AnyTracker<Scalar>::filter_state() const {
    if (filter_) {
        return filter_->filter_state();
    }
    if (const auto* ideal = std::get_if<ScaatTracker<Scalar>>(&method_)) {
        return ideal->filter_state();
    }
    if (const auto* general = std::get_if<GeneralTracker<Scalar>>(&method_)) {
        return general->filter_state();
    }
    return std::nullopt;
}

template class AnyTracker<double>;

}  // namespace tricoil::tracking
