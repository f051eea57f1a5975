// A sensor's tracker behind what is known of its coils: columns as they were measured in, poses in the calibration's frame out.
#pragma once

#include <optional>
#include <variant>

#include "core/calibration/apply.hpp"
#include "core/calibration/concentric_columns.hpp"
#include "core/tracking/scaat/general_measurement.hpp"
#include "core/tracking/sensor_tracker.hpp"

namespace tricoil::tracking {

/// Without a calibration: a SensorTracker. With one of coils that share a place and are square: a SensorTracker of ideal triads,
/// whose columns are corrected; any other needs the filter, which then has the general dipole as its field model (physics 7).
/// What is beyond the field model, the calibration's output correction, is applied to every pose. Hemispheres and poses are in
/// the source frame of the calibration.
template <typename Scalar>
class CalibratedTracker {
public:
    using Filter = std::optional<scaat::Params<Scalar>>;
    using Calibration = std::optional<calibration::Calibration<Scalar>>;

    /// Errors (invalid_argument or not_finite, with the reason): those of the parameters and of the calibration; coils that only
    /// the filter can take, without the filter.
    static Status check(const TrackerParams<Scalar>& params, const Filter& filter, const Calibration& known);

    /// As SensorTracker's; all three must pass check(). With a calibration the coupling constant does not count.
    CalibratedTracker(const TrackerParams<Scalar>& params, const Filter& filter, const Calibration& known);

    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);
    Status set_hemisphere(const Vec3<Scalar>& towards);
    [[nodiscard]] TrackerState state() const;
    [[nodiscard]] const TrackerCounters& counters() const;

private:
    using General = scaat::GeneralMeasurement<Scalar>;
    using GeneralFilter = scaat::Filter<Scalar, General>;

    template <typename Self, typename Action>
    static decltype(auto) visit(Self& self, Action&& action) {
        auto* general = std::get_if<GeneralFilter>(&self.tracker_);
        return general != nullptr ? action(*general) : action(*std::get_if<SensorTracker<Scalar>>(&self.tracker_));
    }
    [[nodiscard]] Column<Scalar> corrected(const Column<Scalar>& column) const;
    [[nodiscard]] std::optional<PoseEstimate<Scalar>> in_source_frame(const std::optional<PoseEstimate<Scalar>>& estimate) const;

    Calibration known_;
    std::optional<calibration::ConcentricColumns<Scalar>> columns_;  // of coils that one column at a time can make ideal
    std::variant<SensorTracker<Scalar>, GeneralFilter> tracker_;
};

extern template class CalibratedTracker<double>;

}  // namespace tricoil::tracking
