// Passes poses relative to one sensor to another tap. Recordings keep the absolute poses: they are separate taps.
#pragma once

#include "board/pose_text/relative_poses.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

class RelativeTap final : public tracking::TrackerTap<double> {
public:
    /// reference: index of the sensor. `next` receives everything but the absolute poses; it must outlive this object.
    RelativeTap(std::uint8_t reference, tracking::TrackerTap<double>& next)
        : next_(next), poses_(reference, [&next](const tracking::PoseEstimate<double>& pose) { next.pose(pose); }) {}

private:
    void do_begin(const Settings& settings) override {
        poses_.reset();
        next_.begin(settings);
    }
    void do_column(const MeasuredColumn<double>& column) override { next_.column(column); }
    void do_tick(std::uint8_t sensor, DeviceTime now) override { next_.tick(sensor, now); }
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override { next_.hemisphere(sensor, towards); }
    void do_pose(const tracking::PoseEstimate<double>& estimate) override { poses_.take(estimate); }
    void do_fault(std::string_view text) override { next_.fault(text); }

    tracking::TrackerTap<double>& next_;
    RelativePoses poses_;
};

}  // namespace tricoil::host
