// Tracker of one sensor: columns in, poses out. Common interface of all methods; applies the calibration.
#pragma once

#include <optional>

#include "core/base/interface.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/front/column_check.hpp"
#include "core/tracking/front/columns_since_gap.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/state/track_state.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// With a coil correction a tracker takes measured columns and reports poses in the calibration's source frame. Without one the
/// coils are ideal. Hemispheres are in the same frame as poses. Of the two quaternions of an attitude the tracker reports the one
/// closer to the last.
template <typename Scalar>
class Tracker : public Interface {
public:
    using Correction = std::optional<calibration::CoilCorrection<Scalar>>;

    /// Processes one column. Returns a pose if the method has one at its time. A refused column is counted. Like a column with
    /// the flag `after_gap`, it sets `columns_missing` in the next poses. A column of the low band gives no pose and is not
    /// counted; methods with one band do not receive it.
    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);

    /// For times without columns: returns a pose flagged coasting or stale, if the method supports it.
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);

    /// Direction to the half space in which the sensor is now; zero: unknown. Errors: not_finite.
    Status set_hemisphere(const Vec3<Scalar>& towards);

    /// Converts a pose of the method, in the frame of corrected columns, as update() does: source frame and output correction.
    void to_source_frame(PoseEstimate<Scalar>& estimate) const;

    [[nodiscard]] TrackerState state() const { return state_.state(); }
    [[nodiscard]] const TrackerCounters& counters() const { return counters_; }

protected:
    /// max_lateness: of a column relative to the newest.
    Tracker(const CommonParams<Scalar>& params, const Correction& correction, Microseconds max_lateness)
        : params_(corrected(params, correction)), time_base_(max_lateness, params.lost_after), correction_(correction) {}

    /// Parameters for corrected columns.
    [[nodiscard]] const CommonParams<Scalar>& params() const { return params_; }
    static CommonParams<Scalar> corrected(CommonParams<Scalar> params, const Correction& correction);

    /// Metal at rest that acts on corrected columns; null: none. Exists as long as the tracker.
    [[nodiscard]] const field::InducedDipoles<Scalar>* surroundings() const {
        return correction_ && !correction_->surroundings().empty() ? &correction_->surroundings() : nullptr;
    }

    /// True if the last valid pose is older than lost_after.
    [[nodiscard]] bool is_stale(DeviceTime now) const {
        return counters_.acquisitions > 0 && state_.is_older(params_.lost_after, now);
    }
    /// Sets state and sequence of a finished pose, and counts it. measured: time of its newest column.
    void count(PoseEstimate<Scalar>& estimate, DeviceTime measured, DeviceTime now);

    /// True if columns of all source coils have come with the newest time.
    [[nodiscard]] bool frame_is_over() const { return time_base_.frame_is_over(); }

    TrackerCounters counters_;

private:
    /// An admitted column of the only or high band. is_late: it is older than the newest.
    virtual std::optional<PoseEstimate<Scalar>> do_update(const Column<Scalar>& column, bool is_late) = 0;
    /// For methods with two bands, in double: a column of the low band.
    virtual void do_update_low(const Column<Scalar>& /*column*/) {}
    /// The device clock restarted at `now`: stored times are invalid.
    virtual void do_restart(DeviceTime now) = 0;
    /// now: a plausible time.
    virtual std::optional<PoseEstimate<Scalar>> do_tick(DeviceTime now) = 0;
    virtual void do_set_hemisphere(const Vec3<Scalar>& towards) = 0;

    /// A column of the only or high band.
    std::optional<PoseEstimate<Scalar>> update_high(const Column<Scalar>& column);
    std::optional<PoseEstimate<Scalar>> track(const Column<Scalar>& corrected);
    [[nodiscard]] std::uint64_t used_columns() const { return counters_.accepted - counters_.outliers; }
    void update_low(const Column<Scalar>& column);
    void finish(std::optional<PoseEstimate<Scalar>>& estimate);
    void cover_constant_errors(PoseEstimate<Scalar>& estimate) const;
    void add_converter_error(const Mat3<Scalar>& x, calibration::CoilErrors<Scalar>& errors) const;
    CommonParams<Scalar> params_;
    TimeBase time_base_;
    TrackState state_;
    Correction correction_;
    ColumnsSinceGap since_gap_;
    Quat<Scalar> last_reported_ = Quat<Scalar>::Identity();
};

extern template class Tracker<float>;
extern template class Tracker<double>;

}  // namespace tricoil::tracking
