// Poses of a simulated run as JSON lines on standard output.
#pragma once

#include "board/pose_text/served_pose_line.hpp"
#include "board/support/output_file.hpp"
#include "board/support/tool_tip.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// The lines of `tricoil serve --json-lines`. The simulation waits for the reader, so no pose is lost. utc_s is the time of the
/// construction plus the simulated time.
class JsonLinesTap final : public tracking::TrackerTap<double> {
public:
    explicit JsonLinesTap(const ToolTips& tips) : tips_(tips) {}

private:
    void do_pose(const tracking::PoseEstimate<double>& estimate) override {
        out_.write(served_pose_line({tips_.at_tip(estimate), begin_ + estimate.time.since_start()}));
        out_.flush();  // a reader of a run in real time gets each pose at once
    }

    ToolTips tips_;
    OutputFile out_{kStandardOutput};
    UtcTime begin_ = utc_now();
};

}  // namespace tricoil::host
