// Tracker of one sensor: columns in, poses out. Common interface of all methods; applies the calibration.
#pragma once

#include <optional>

#include "core/calibration/coil_correction.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/columns_since_gap.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_counters.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// With a coil correction a tracker takes measured columns and reports poses in the calibration's source frame. Without one the
/// coils are ideal. Hemispheres are in the same frame as poses. Of the two quaternions of an attitude the tracker reports the one
/// closer to the last.
template <typename Scalar>
class Tracker {
public:
    using Correction = std::optional<calibration::CoilCorrection<Scalar>>;

    virtual ~Tracker() = default;
    Tracker(const Tracker&) = delete;
    Tracker& operator=(const Tracker&) = delete;

    /// Processes one column. Returns a pose if the method has one at its time. A refused column is counted. Like a column with
    /// the flag `after_gap`, it sets `columns_missing` in the next poses. A column of the low band gives no pose by itself and is
    /// not counted; only in double, because trackers in float use one band.
    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);

    /// For times without columns: returns a pose flagged coasting or stale, if the method supports it.
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);

    /// Direction to the half space in which the sensor is now; zero: unknown. Errors: not_finite.
    Status set_hemisphere(const Vec3<Scalar>& towards);

    /// Converts a pose of the method, in the frame of corrected columns, as update() does: source frame and output correction.
    void to_source_frame(PoseEstimate<Scalar>& estimate) const;

    [[nodiscard]] TrackerState state() const { return do_state(); }
    [[nodiscard]] const TrackerCounters& counters() const { return do_counters(); }

protected:
    explicit Tracker(const Correction& correction) : correction_(correction) {}

    /// Parameters for corrected columns.
    static CommonParams<Scalar> corrected(CommonParams<Scalar> params, const Correction& correction);

    /// Metal at rest that acts on corrected columns; null: none. Exists as long as the tracker.
    [[nodiscard]] const field::InducedDipoles<Scalar>* surroundings() const {
        return correction_ && !correction_->surroundings().empty() ? &correction_->surroundings() : nullptr;
    }

private:
    virtual std::optional<PoseEstimate<Scalar>> do_update(const Column<Scalar>& column) = 0;
    /// A column of the low band; called only in double. Methods with one band ignore it.
    virtual void do_update_low(const Column<Scalar>& /*column*/) {}
    virtual std::optional<PoseEstimate<Scalar>> do_tick(DeviceTime now) = 0;
    virtual void do_set_hemisphere(const Vec3<Scalar>& towards) = 0;
    [[nodiscard]] virtual TrackerState do_state() const = 0;
    [[nodiscard]] virtual const TrackerCounters& do_counters() const = 0;

    [[nodiscard]] std::uint64_t used_columns() const { return do_counters().accepted - do_counters().outliers; }
    void update_low(const Column<Scalar>& column);
    void finish(std::optional<PoseEstimate<Scalar>>& estimate);
    Correction correction_;
    ColumnsSinceGap since_gap_;
    Quat<Scalar> last_reported_ = Quat<Scalar>::Identity();
};

extern template class Tracker<float>;
extern template class Tracker<double>;

}  // namespace tricoil::tracking
