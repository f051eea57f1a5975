#include "board/pose_text/flag_names.hpp"

#include <array>

namespace tricoil::host {
namespace {

// Order of PoseFlag.
constexpr std::array<const char*, 15> kFlags{"saturated",        "low_signal",      "no_sensor",     "distorted",
                                             "wrong_handedness", "stale",           "not_converged", "hemisphere_unknown",
                                             "no_reference",     "unconfirmed",     "inconsistent",  "coasting",
                                             "uncertain",        "columns_missing", "roll_undefined"};

}  // namespace

std::span<const char* const> flag_names() { return kFlags; }

std::string to_text(tracking::PoseFlags flags) {
    std::string text;
    for (std::size_t bit = 0; bit < kFlags.size(); ++bit) {
        if (flags.has(static_cast<tracking::PoseFlag>(bit))) {
            text += (text.empty() ? "" : ", ") + std::string(kFlags[bit]);
        }
    }
    return text;
}

std::string advice(tracking::PoseFlags flags) {
    return flags.has(tracking::PoseFlag::hemisphere_unknown) ? "the hemisphere is unknown: set it to the half space of the "
                                                               "sensor, or use --confined if the sensor never leaves it"
                                                             : "";
}

// Distortion comes first: it may also hide the half space of the sensor.
std::string advice_without_poses(tracking::PoseFlags flags) {
    const bool is_distorted = flags.has(tracking::PoseFlag::distorted);
    std::string text = to_text(flags);
    text += is_distorted ? "; is metal near the coils, is --calibration missing, or is it that of other coils?" : "";
    if (flags.has(tracking::PoseFlag::hemisphere_unknown)) {
        text += is_distorted ? " If not, give" : "; give";
        text += " the half space of the sensor with --hemisphere X,Y,Z, or use --confined";
    }
    return text;
}

const char* to_text(tracking::TrackerState state) {
    switch (state) {
        case tracking::TrackerState::searching:
            return "searching";
        case tracking::TrackerState::tracking:
            return "tracking";
        case tracking::TrackerState::lost:
            break;
    }
    return "lost";
}

}  // namespace tricoil::host
