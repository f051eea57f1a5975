// The tracker of one sensor: columns in, poses out. The interface of every method, and the one place that applies a calibration.
#pragma once

#include <optional>

#include "core/calibration/coil_correction.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_counters.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// With the correction of its coils a tracker takes columns as they were measured and reports poses in the calibration's source
/// frame; without one the coils are ideal. Hemispheres are in the same frame as poses. Of the two quaternions of an attitude, a
/// tracker reports the one that is nearer to the last.
template <typename Scalar>
class Tracker {
public:
    using Correction = std::optional<calibration::CoilCorrection<Scalar>>;

    virtual ~Tracker() = default;
    Tracker(const Tracker&) = delete;
    Tracker& operator=(const Tracker&) = delete;

    /// Takes one column; a pose if there is one at its time. A refused column is counted and changes nothing else.
    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);

    /// Called when a column did not come: a pose if the method has one to say, flagged coasting or stale.
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);

    /// Points to the half space in which the sensor is now; zero makes it unknown. Refused (not_finite) if not finite.
    Status set_hemisphere(const Vec3<Scalar>& towards);

    [[nodiscard]] TrackerState state() const { return do_state(); }
    [[nodiscard]] const TrackerCounters& counters() const { return do_counters(); }

protected:
    explicit Tracker(const Correction& correction) : correction_(correction) {}

    /// The parameters for corrected columns.
    static CommonParams<Scalar> corrected(CommonParams<Scalar> params, const Correction& correction);

private:
    virtual std::optional<PoseEstimate<Scalar>> do_update(const Column<Scalar>& column) = 0;
    virtual std::optional<PoseEstimate<Scalar>> do_tick(DeviceTime now) = 0;
    virtual void do_set_hemisphere(const Vec3<Scalar>& towards) = 0;
    [[nodiscard]] virtual TrackerState do_state() const = 0;
    [[nodiscard]] virtual const TrackerCounters& do_counters() const = 0;

    void finish(std::optional<PoseEstimate<Scalar>>& estimate);
    void to_source_frame(PoseEstimate<Scalar>& estimate) const;

    Correction correction_;
    Quat<Scalar> last_reported_ = Quat<Scalar>::Identity();
};

extern template class Tracker<float>;
extern template class Tracker<double>;

}  // namespace tricoil::tracking
