// Runs the SCAAT filter and the smoother on the inputs of trackers, for all sensors. With two bands, metal is removed first.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "board/record/tracker_settings.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {

/// Pose and rates from the columns before and after it. Covariance, flags: see Smoother.
struct SmoothedPose {
    tracking::PoseEstimate<double> pose;
    Vec3<double> velocity_m_s = Vec3<double>::Zero();  // source frame
    Vec3<double> rate_rad_s = Vec3<double>::Zero();    // angular rate, source frame
};

/// Fixed-interval smoother over the states of the SCAAT filter: Rauch, Tung and Striebel (1965, AIAA Journal 3(8)) for one
/// sensor. Memory is bounded: poses are smoothed in pieces, each with the following 4,096 poses, after which later columns have
/// no effect.
///
/// The covariance is 0.75 times the smoothed covariance of the filter's model, plus the terms that the filter adds for metal and
/// blur. Flags are those of the filter, except not_converged: it is cleared, because later columns contribute.
class Smoother {
public:
    using Receiver = std::function<void(const SmoothedPose&)>;
    explicit Smoother(Receiver receiver) : receiver_(std::move(receiver)) {}

    /// A pose that update() of `tracker` has just returned. The tracker must be a filter, without prediction.
    void add(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker<double>& tracker);

    /// A pose that the filter did not get. It is delivered as it is, and ends an interval.
    void add_unsmoothed(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker<double>& tracker);

    /// Smooths and delivers the remaining poses. add() may follow, also with a new tracker.
    void finish(const tracking::AnyTracker<double>& tracker);

private:
    struct Step {
        tracking::PoseEstimate<double> filtered;
        tracking::scaat::FilterState<double> filter;
        bool begins = false;  // an interval: the state does not follow from the one before
    };

    void add(const Step& step, const tracking::AnyTracker<double>& tracker);
    [[nodiscard]] bool begins_interval(const tracking::PoseEstimate<double>& estimate,
                                       const tracking::AnyTracker<double>& tracker);
    static SmoothedPose reported(const Step& step, const tracking::scaat::State<double>& smoothed,
                                 const tracking::AnyTracker<double>& tracker);
    void smooth_first(std::size_t count, const tracking::AnyTracker<double>& tracker);

    Receiver receiver_;
    std::vector<Step> steps_;
    std::uint64_t inflations_ = 0;  // of the covariance of the filter, until the last pose
};

/// The same settings with the SCAAT filter as the method and without prediction.
TrackerSettings for_smoothing(TrackerSettings settings);

/// Poses arrive at the receiver with a delay of up to 36,864 poses, each sensor's in the order of time.
class SmoothingTap final : public tracking::TrackerTap<double> {
public:
    explicit SmoothingTap(Smoother::Receiver receiver) : receiver_(std::move(receiver)) {}

    /// Delivers the remaining poses.
    void finish();

private:
    struct Sensor {
        Sensor(const Settings& settings, const TrackerSettings& of_filter, const Smoother::Receiver& receiver);

        void take(const Column<double>& column);
        std::optional<tracking::PoseEstimate<double>> filter_without_metal(const tracking::PoseEstimate<double>& pose);

        std::optional<tracking::AnyTracker<double>> both_bands;  // removes metal before the filter; empty: one band
        tracking::AnyTracker<double> filter;
        Smoother smoother;
        double coupling_constant;
        std::uint32_t columns = 0;  // of the filter, with two bands
    };

    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_pose(const tracking::PoseEstimate<double>& /*estimate*/) override {}

    Smoother::Receiver receiver_;
    std::vector<std::unique_ptr<Sensor>> sensors_;
};

}  // namespace tricoil::host
