// Runs the inputs of a recording through the same or other trackers.
#pragma once

#include <string>

#include "board/pose_text/output_format.hpp"
#include "board/record/recording.hpp"
#include "board/support/progress.hpp"
#include "board/support/statistics.hpp"

namespace tricoil::host {

struct ReplayReport {
    std::uint64_t inputs = 0;
    std::uint64_t poses = 0;
    std::uint64_t valid_poses = 0;
    std::uint64_t compared =
        0;  // poses with a recorded pose at the same place in the file, or of the same sensor and time (midway, other tracker)
    std::uint64_t equal = 0;  // compared poses that are equal bit for bit
    std::uint64_t only_replayed = 0;
    std::uint64_t only_recorded = 0;
    double tail_s = 0;             // from the last recorded to the last replayed pose
    std::string first_difference;  // "FILE:LINE"; empty if none
    double rms_position_m = 0;     // difference between replayed and recorded poses, both valid
    double rms_orientation_rad = 0;
    ErrorSummary error_m;  // of the first sensor against its true poses; see statistics.hpp
    ErrorSummary error_rad;
    std::uint64_t scored = 0;  // of these errors; 0: no true poses

    /// True if no pose differs and none is missing. If the recording is not complete, its last second may be missing.
    [[nodiscard]] bool reproduces(bool complete) const {
        constexpr double kLastSecond = 1;
        const bool all_compared = only_replayed + only_recorded == 0;
        return equal == compared && (all_compared || (!complete && equal > 0 && tail_s <= kLastSecond));
    }
};

/// out: output file with the format of poses.csv; empty: none. options: stages before the file; the comparison is of the poses of
/// the sensors. progress: called for every input; may be empty. Throws InputError for a damaged line, DeviceError if `out` cannot
/// be written completely.
ReplayReport replay(const Recording& recording, const TrackerSettings& settings, const std::string& out,
                    const OutputOptions& options = {}, const ShowShare& progress = {});

}  // namespace tricoil::host
