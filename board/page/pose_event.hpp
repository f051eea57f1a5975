// Poses for the live page: in compact form, for its plots and for playback, and in events.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "board/page/tour.hpp"
#include "board/pose_text/served_pose.hpp"
#include "board/support/link_health.hpp"

namespace tricoil::host {

struct RecordingStatus {
    bool on = false;
    std::string error;        // failure of the last recording, one line; empty: none
    std::string name;         // of the running recording
    double seconds = 0;       // since its start
    std::uint64_t bytes = 0;  // of its files
};

namespace web {

/// Names of the numbers of a pose: time of the device (us) and in UTC (ms), position in m, quaternion, covariance of the position
/// in m^2, predicted error in mm, expected error in mm, distortion in mm, signal-to-noise ratio. A number that is unknown is
/// null.
inline constexpr std::array kCompactColumns{"sensor", "time_us", "utc_ms", "flags", "state",    "x",           "y",
                                            "z",      "qw",      "qx",     "qy",    "qz",       "cxx",         "cxy",
                                            "cxz",    "cyy",     "cyz",    "czz",   "error_mm", "expected_mm", "distortion_mm",
                                            "snr_db"};

/// Appends the numbers as a JSON array. A pose of a simulation ends with an array of its true position (m) and quaternion.
void put_compact(const ServedPose& served, std::string& out);

struct PageStatus {
    bool running = true;
    RecordingStatus recording;
    std::string controls;  // access rule: "token", "open" or "none"
    int pages = 1;         // connected now
    UtcTime now;
    LinkHealth health;
    std::vector<Vec3<double>> confinement;  // of PoseHub
    TourPlace tour = {};
    nlohmann::ordered_json levels = nullptr;  // PageLevels::newer()
    double other_error_m = 0;                 // Tour::other_error_m
};

/// Data that a page needs once: columns of the compact form, names of flags and states, the flags that make a pose invalid, the
/// kind of the source. source: description as in a recording.
nlohmann::ordered_json greeting(const nlohmann::ordered_json& source);

/// One server-sent event: {"status": {...}, "poses": [...]} with every pose in compact form. Poses that are not finite are left
/// out. hello: added to the first event of a stream; null: none.
std::string pose_event(std::span<const ServedPose> poses, const PageStatus& status, const nlohmann::ordered_json& hello);

}  // namespace web
}  // namespace tricoil::host
