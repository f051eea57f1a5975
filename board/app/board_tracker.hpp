// The tracker of a board with one sensor: the filter alone, behind the calibration of the board's coils.
#pragma once

#include <optional>

#include "core/calibration/concentric_columns.hpp"
#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/tracker.hpp"

namespace tricoil::app {

/// What MainLoop asks of a tracker, without the solvers that have no memory of motion: a fifth of the program's flash.
class BoardTracker {
public:
    using Filter = tracking::scaat::Filter<float>;

    /// `filter` must be given.
    BoardTracker(const tracking::TrackerParams<float>& params, const std::optional<tracking::scaat::Params<float>>& filter)
        : filter_(*filter, tracking::scaat::ConcentricMeasurement<float>{params.coupling_constant}) {}

    /// Columns are what these coils measure; null: ideal ones. Must outlive the tracker.
    void use(const calibration::ConcentricColumns<float>* coils) { coils_ = coils; }

    std::optional<tracking::PoseEstimate<float>> update(const Column<float>& column) {
        if (coils_ == nullptr || column.flags.has(ColumnFlag::no_reference)) {
            return filter_.update(column);
        }
        Column<float> ideal = column;
        coils_->apply(coil_index(column.state), ideal.in_phase, ideal.quadrature, ideal.sigma);
        return filter_.update(ideal);
    }
    std::optional<tracking::PoseEstimate<float>> tick(DeviceTime now) { return filter_.tick(now); }
    Status set_hemisphere(const Vec3<float>& towards) { return filter_.set_hemisphere(towards); }

private:
    Filter filter_;
    const calibration::ConcentricColumns<float>* coils_ = nullptr;
};

}  // namespace tricoil::app
