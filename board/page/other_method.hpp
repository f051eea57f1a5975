// The error of the other method, beside that of the one which the guided tour shows.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>

#include "board/pose_text/expected_error.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host::web {

/// The method that the tour does not show, on the same columns: the filter beside columns solved as if simultaneous, or these
/// beside the filter.
class OtherMethod final : public tracking::TrackerTap<double> {
public:
    /// error_m: becomes the RMS over the last second of its position error (3D), m; NaN if unknown.
    explicit OtherMethod(std::atomic<double>& error_m) : error_m_(error_m) {}

private:
    void do_begin(const Settings& settings) override {
        auto params = settings.tracker;
        params.method = method_of_name(estimates_velocity(params.method) ? "direct" : "scaat");
        tracker_.emplace(params);
        pose_.reset();
        recent_ = {};
        error_m_ = std::nan("");
    }
    void do_column(const MeasuredColumn<double>& column) override { pose_ = tracker_->update(column); }
    void do_truth(std::uint8_t /*sensor*/, DeviceTime time, const solver::RigidPose<double>& truth) override {
        if (pose_ && pose_->time == time) {
            error_m_ = recent_.after(*pose_, (pose_->position_m - truth.position_m).squaredNorm());
        }
    }

    std::optional<tracking::AnyTracker> tracker_;
    std::optional<tracking::PoseEstimate<double>> pose_;  // of the newest column
    ExpectedError recent_;
    std::atomic<double>& error_m_;
};

}  // namespace tricoil::host::web
