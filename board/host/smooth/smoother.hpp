// Fixed-interval smoother over the states of the SCAAT filter.
#pragma once

#include <functional>
#include <vector>

#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {

/// Pose and rates from the columns before and after it. Covariance, flags: see Smoother.
struct SmoothedPose {
    tracking::PoseEstimate<double> pose;
    Vec3<double> velocity_m_s = Vec3<double>::Zero();     // source frame
    Vec3<double> rate_rad_s = Vec3<double>::Zero();       // angular rate, source frame
    Mat6<double> rate_covariance = Mat6<double>::Zero();  // of both; frame of corrected columns
};

/// Rauch, Tung and Striebel (1965, AIAA Journal 3(8)) for one sensor. Memory is bounded: poses are smoothed in pieces, each with
/// the following 4,096 poses, after which later columns have no effect.
///
/// The covariance is 0.75 times the smoothed covariance of the filter's model, plus the terms that the filter adds for metal and
/// blur. Flags are those of the filter, except not_converged: it is cleared, because later columns contribute.
class Smoother {
public:
    using Receiver = std::function<void(const SmoothedPose&)>;
    explicit Smoother(Receiver receiver) : receiver_(std::move(receiver)) {}

    /// A pose that update() of `tracker` has just returned. The tracker must have a filter, without prediction. A pose that was
    /// not filtered is delivered as it is, and ends an interval.
    void add(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker& tracker);

    /// Smooths and delivers the remaining poses. add() may follow, also with a new tracker.
    void finish(const tracking::AnyTracker& tracker);

private:
    struct Step {
        tracking::PoseEstimate<double> filtered;
        tracking::scaat::FilterState<double> filter;
        bool begins = false;  // an interval: the state does not follow from the one before
    };

    [[nodiscard]] bool begins_interval(const Step& step) const;
    static SmoothedPose reported(const Step& step, const tracking::scaat::State<double>& smoothed,
                                 const tracking::AnyTracker& tracker);
    void smooth_first(std::size_t count, const tracking::AnyTracker& tracker);

    Receiver receiver_;
    std::vector<Step> steps_;
};

}  // namespace tricoil::host
