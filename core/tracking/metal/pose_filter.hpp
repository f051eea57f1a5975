// SCAAT filter over the poses of a tracker that removes metal: velocity, prediction, and states for a smoother.
#pragma once

#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::tracking {

/// The filter gets the couplings that ideal coils without metal would have at each pose. The poses have the noise of one frame,
/// which the filter reduces. What metal adds to the covariance stays, because it lasts from frame to frame.
class PoseFilter {
public:
    /// common: of the tracker whose poses are filtered. predict_ahead: as ScaatParams::predict_ahead.
    PoseFilter(const CommonParams<double>& common, Microseconds predict_ahead);

    /// A pose without a known side, or with a fault, is returned as it is.
    PoseEstimate<double> update(const PoseEstimate<double>& pose);
    /// A pose between those of update(). pose: of the tracker; returned if the filter does not run.
    std::optional<PoseEstimate<double>> tick(DeviceTime now, std::optional<PoseEstimate<double>> pose);

    /// State after the last pose; run is 0 if it was not filtered.
    [[nodiscard]] scaat::FilterState<double> filter_state() const;

private:
    std::optional<PoseEstimate<double>> filtered(const PoseEstimate<double>& pose);
    [[nodiscard]] PoseEstimate<double> with_metal(PoseEstimate<double> estimate);

    ScaatTracker<double> filter_;
    double coupling_constant_;
    PoseEstimate<double> newest_;                   // without the filter
    Mat6<double> of_metal_ = Mat6<double>::Zero();  // part of its covariance
    bool is_filtered_ = false;                      // the newest pose
    std::uint32_t columns_ = 0;
    std::uint32_t poses_ = 0;
};

}  // namespace tricoil::tracking
