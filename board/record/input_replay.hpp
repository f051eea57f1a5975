// Runs recorded inputs through trackers.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/record/record_lines.hpp"
#include "board/record/tracker_settings.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {

/// Settings of a recording with another tracker: direct, previous, previous-angles or scaat. Throws InputError for an unknown
/// name and for settings that the tracker does not support.
TrackerSettings with_tracker(const TrackerSettings& recorded, const std::string& tracker);

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
