// Runs recorded inputs through trackers.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/record/record_lines.hpp"
#include "board/record/recording.hpp"
#include "board/record/tracker_settings.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {

/// Settings of a recording, which must have some, with another tracker. Throws InputError for an unknown name, for settings that
/// the tracker does not support, and like two_band_frame_s() for dual-band.
TrackerSettings with_tracker(const Recording& recording, const std::string& tracker);

/// One tracker per sensor, created again at each `begin` of the recording.
class InputReplay {
public:
    explicit InputReplay(const TrackerSettings& settings);

    /// Pose that the input causes, if any. Throws InputError, beginning with `where`, for a sensor that the settings do not have.
    std::optional<tracking::PoseEstimate<double>> take(const TrackerInput& input, const std::string& where);

private:
    void make_trackers();

    TrackerSettings settings_;
    std::vector<std::unique_ptr<tracking::AnyTracker<double>>> trackers_;
};

}  // namespace tricoil::host
