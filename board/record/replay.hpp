// Runs a recording's inputs through its trackers again, or through others.
#pragma once

#include <optional>
#include <string>

#include "board/record/recording.hpp"

namespace tricoil::host {

struct ReplayReport {
    std::uint64_t inputs = 0;
    std::uint64_t poses = 0;
    std::uint64_t valid_poses = 0;
    std::uint64_t compared = 0;  // with a recorded pose of the same sensor, and number or time
    std::uint64_t equal = 0;     // of those: bit for bit
    std::uint64_t only_replayed = 0;
    std::uint64_t only_recorded = 0;
    double tail_s = 0;             // between the last recorded and the last replayed pose
    std::string first_difference;  // "FILE:LINE"; empty if none
    double rms_position_m = 0;     // of the difference to the recorded poses, both valid
    double rms_orientation_rad = 0;

    /// Nothing differs, and nothing is missing but what a killed program could not write: its last second.
    [[nodiscard]] bool reproduces(bool complete) const {
        constexpr double kLastSecond = 1;
        const bool all_compared = only_replayed + only_recorded == 0;
        return equal == compared && (all_compared || (!complete && equal > 0 && tail_s <= kLastSecond));
    }
};

/// The settings of a recording with another tracker: one of direct, previous, previous-angles, scaat. Throws InputError for an
/// unknown name, and for settings that it cannot work with.
TrackerSettings with_tracker(const TrackerSettings& recorded, const std::string& tracker);

/// out: poses as in a recording's poses.csv; empty: none. Throws InputError for a line that is damaged, DeviceError if `out`
/// cannot be written completely.
ReplayReport replay(const Recording& recording, const TrackerSettings& settings, const std::string& out);

}  // namespace tricoil::host
