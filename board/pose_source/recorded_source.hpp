// Poses of a recording, computed again from its columns.
#pragma once

#include "board/pose_source/pose_source.hpp"
#include "board/record/recording_player.hpp"

namespace tricoil::host {

/// A recording without columns (the device computed the poses) gives its recorded poses.
class RecordedSource final : public PoseSource {
public:
    /// tracker: direct, previous or scaat; empty: that of the recording. Throws InputError if the folder is not
    /// a recording, or if the recording cannot be tracked by `tracker`.
    RecordedSource(const std::string& folder, const std::string& tracker)
        : recording_(folder), trackers_(queue()), player_(recording_, settings_of(recording_, tracker), trackers_) {}

private:
    bool do_advance(Microseconds patience) override;
    bool do_set_hemisphere(std::size_t /*sensor*/, const Vec3<double>& /*towards*/) override { return false; }
    [[nodiscard]] std::string do_status() const override;

    Recording recording_;
    TrackerStage trackers_;
    RecordingPlayer player_;
    bool ended_ = false;
};

}  // namespace tricoil::host
