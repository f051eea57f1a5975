#include "core/tracking/calibrated_tracker.hpp"

#include "core/tracking/output_frame.hpp"
#include "core/tracking/scaat/filter_impl.hpp"

namespace tricoil::tracking {
namespace {

template <typename Scalar>
std::optional<calibration::ConcentricColumns<Scalar>> ideal_columns(
    const std::optional<calibration::Calibration<Scalar>>& known) {
    if (!known) {
        return std::nullopt;
    }
    const auto columns = calibration::ConcentricColumns<Scalar>::make(*known);
    return columns.ok() ? std::optional(*columns) : std::nullopt;
}

/// Parameters for triads that are ideal, in the coils' own axes.
template <typename Scalar>
TrackerParams<Scalar> of_ideal_triads(TrackerParams<Scalar> params, const calibration::ConcentricColumns<Scalar>& columns) {
    params.coupling_constant = 1;
    params.hemisphere = columns.axes().transpose() * params.hemisphere;
    return params;
}

template <typename Scalar>
std::optional<scaat::Params<Scalar>> of_ideal_triads(std::optional<scaat::Params<Scalar>> filter,
                                                     const calibration::ConcentricColumns<Scalar>& columns) {
    if (filter) {
        filter->hemisphere = columns.axes().transpose() * filter->hemisphere;
    }
    return filter;
}

}  // namespace

template <typename Scalar>
Status CalibratedTracker<Scalar>::check(const TrackerParams<Scalar>& params, const Filter& filter, const Calibration& known) {
    if (const Status status = tracking::check(params); !status.ok()) {
        return status;
    }
    if (filter) {
        if (const Status status = scaat::check(*filter); !status.ok()) {
            return status;
        }
    }
    if (!known) {
        return {};
    }
    if (const Status status = calibration::check(*known); !status.ok()) {
        return status;
    }
    const Status square = calibration::ConcentricColumns<Scalar>::make(*known).status();
    return filter ? Status{} : square;
}

template <typename Scalar>
CalibratedTracker<Scalar>::CalibratedTracker(const TrackerParams<Scalar>& params, const Filter& filter, const Calibration& known)
    : known_(known), columns_(ideal_columns(known)), tracker_(std::in_place_type<SensorTracker<Scalar>>, params, std::nullopt) {
    if (columns_) {
        tracker_.template emplace<SensorTracker<Scalar>>(of_ideal_triads(params, *columns_), of_ideal_triads(filter, *columns_));
    } else if (known_ && filter) {
        tracker_.template emplace<GeneralFilter>(*filter, General{known_->model});
    } else if (filter) {
        tracker_.template emplace<SensorTracker<Scalar>>(params, filter);
    }
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> CalibratedTracker<Scalar>::update(const Column<Scalar>& column) {
    const Column<Scalar> taken = known_ ? corrected(column) : column;
    return in_source_frame(visit(*this, [&](auto& tracker) { return tracker.update(taken); }));
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> CalibratedTracker<Scalar>::tick(DeviceTime now) {
    return in_source_frame(visit(*this, [&](auto& tracker) { return tracker.tick(now); }));
}

template <typename Scalar>
Status CalibratedTracker<Scalar>::set_hemisphere(const Vec3<Scalar>& towards) {
    const Vec3<Scalar> turned = columns_ ? Vec3<Scalar>(columns_->axes().transpose() * towards) : towards;
    return visit(*this, [&](auto& tracker) { return tracker.set_hemisphere(turned); });
}

template <typename Scalar>
TrackerState CalibratedTracker<Scalar>::state() const {
    return visit(*this, [](const auto& tracker) { return tracker.state(); });
}

template <typename Scalar>
const TrackerCounters& CalibratedTracker<Scalar>::counters() const {
    return visit(*this, [](const auto& tracker) -> const TrackerCounters& { return tracker.counters(); });
}

/// Phases, and where that can be done for one column alone, gains and angles.
template <typename Scalar>
Column<Scalar> CalibratedTracker<Scalar>::corrected(const Column<Scalar>& column) const {
    Column<Scalar> taken = column;
    if (columns_) {
        columns_->apply(coil_index(taken.state), taken.in_phase, taken.quadrature, taken.sigma);
    } else {
        taken.in_phase = calibration::at_phase<Scalar>(*known_, column.in_phase, column.quadrature);
        taken.quadrature = calibration::at_phase<Scalar>(*known_, column.quadrature, -column.in_phase);
    }
    return taken;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> CalibratedTracker<Scalar>::in_source_frame(
    const std::optional<PoseEstimate<Scalar>>& estimate) const {
    if (!known_ || !estimate) {
        return estimate;
    }
    PoseEstimate<Scalar> seen = *estimate;
    if (columns_) {
        OutputFrame<Scalar> frame;
        frame.q_source_alignment = Quat<Scalar>(columns_->axes()).conjugate().normalized();
        seen = in_frame(seen, frame);
    }
    seen.position_m = calibration::corrected_position(*known_, seen.position_m);
    Mat6<Scalar> jacobian = Mat6<Scalar>::Identity();
    jacobian.template topLeftCorner<3, 3>() = known_->output_linear;
    seen.covariance = jacobian * seen.covariance * jacobian.transpose();
    return seen;
}

template class CalibratedTracker<double>;

}  // namespace tricoil::tracking
