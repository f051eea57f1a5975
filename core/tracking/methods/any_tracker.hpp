// Tracker in double with a method chosen at run time, without heap. For programs that offer all methods.
#pragma once

#include "core/tracking/judge/surroundings_change.hpp"
#include "core/tracking/matrix/direct_tracker.hpp"
#include "core/tracking/matrix/previous_tracker.hpp"
#include "core/tracking/metal/dual_band_tracker.hpp"
#include "core/tracking/metal/pose_filter.hpp"
#include "core/tracking/scaat/general_tracker.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::tracking {

// Tracker of each method.
DirectTracker<double> tracker_of(const DirectParams&);
PreviousTracker<double> tracker_of(const PreviousParams&);
ScaatTracker<double> tracker_of(const ScaatParams<double>&);
DualBandTracker tracker_of(const DualBandParams&);

template <typename Params>
using TrackerOf = decltype(tracker_of(std::declval<Params>()));

/// The parameters select the method. Coils that CoilCorrection cannot correct need the filter; the tracker is then a
/// GeneralTracker.
class AnyTracker {
public:
    using Calibration = std::optional<calibration::Calibration<double>>;
    using Correction = Tracker<double>::Correction;

    /// Errors (invalid_argument or not_finite, with the reason): those of the parameters and of the calibration; coils that need
    /// the filter while another method is selected; those of DualBandTracker::check().
    static Status check(const TrackerParams<double>& params, const Calibration& coils);

    /// Both must pass check().
    AnyTracker(const TrackerParams<double>& params, const Calibration& coils);
    /// For ideal triads, or coils that the correction makes ideal.
    explicit AnyTracker(const TrackerParams<double>& params, const Correction& correction = std::nullopt);

    std::optional<PoseEstimate<double>> update(const Column<double>& column) {
        const std::uint64_t accepted = counters().accepted;
        auto pose = tracker_->update(column);
        if (change_ && counters().accepted > accepted) {
            change_->update(column, pose);
        }
        return pose && filter_ ? filter_->update(*pose) : pose;
    }
    std::optional<PoseEstimate<double>> tick(DeviceTime now) {
        const auto pose = tracker_->tick(now);
        return filter_ ? filter_->tick(now, pose) : pose;
    }
    Status set_hemisphere(const Vec3<double>& towards) { return tracker_->set_hemisphere(towards); }
    [[nodiscard]] TrackerState state() const { return tracker_->state(); }
    /// Converts a pose from the frame of filter_state(), as Tracker::to_source_frame().
    void to_source_frame(PoseEstimate<double>& estimate) const {
        if (!filter_) {  // which gets poses in the source frame
            tracker_->to_source_frame(estimate);
        }
    }
    /// Empty if the method has no filter.
    [[nodiscard]] std::optional<scaat::FilterState<double>> filter_state() const;
    [[nodiscard]] const TrackerCounters& counters() const { return tracker_->counters(); }

private:
    template <typename... Params>
    static std::variant<std::monostate, TrackerOf<Params>..., GeneralTracker<double>> any_of(const std::variant<Params...>&);

    void make(const TrackerParams<double>& params, const Correction& correction);

    decltype(any_of(std::declval<MethodParams<double>>())) method_;
    Tracker<double>* tracker_ = nullptr;  // in method_
    std::optional<PoseFilter> filter_;
    std::optional<SurroundingsChange> change_;
};

}  // namespace tricoil::tracking
