// Settings of one of the four stations (receivers) of a FASTRAK.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "board/pose_text/served_pose.hpp"
#include "core/geometry/angles.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::host::fastrak {

constexpr int kStations = 4;
constexpr int kStylusStation = 1;  // the only station whose stylus has a button (manual, "e")
constexpr double kLongest = 1000;  // limit of coordinates in commands, inches or centimetres
constexpr std::size_t kIdentificationSize = 32;

/// Supported items of an output list (Polhemus, FASTRAK user manual OPM00PI002, "O").
enum class Item : int {
    space = 0,
    line_end = 1,
    position = 2,
    movement = 3,  // change since the last record
    euler = 4,
    x_cosines = 5,  // x components of the receiver's three axes: a row of the attitude matrix
    y_cosines = 6,
    z_cosines = 7,
    quaternion = 11,
    stylus = 16,
};
constexpr int kExtended = 50;  // added to an item: extended precision

/// Default alignment, the source frame: origin, points at 2 m on the x and y axes (manual, "A": 200 cm).
inline const std::array<Vec3<double>, 3> kAlignment_m{Vec3<double>::Zero(), Vec3<double>(2, 0, 0), Vec3<double>(0, 2, 0)};

/// Filter settings F, FLOW, FHIGH, FACTOR. The manual ("v") gives the values of kMediumFilter and states that a FLOW of 1
/// disables the filter. It does not define "low" and "heavy"; these values are our choice.
constexpr std::array<double, 4> kNoFilter{0.2, 1, 0.8, 0.95};
constexpr std::array<double, 4> kWeakFilter{0.2, 0.4, 0.9, 0.95};
constexpr std::array<double, 4> kMediumFilter{0.2, 0.2, 0.8, 0.95};
constexpr std::array<double, 4> kStrongFilter{0.1, 0.05, 0.6, 0.95};

/// Upper limits of three values, then lower limits. Manual, "V" and "Q".
using Envelope = std::array<double, 6>;

/// Settings of one station. ^K stores and ^Y restores them.
struct StationSettings {
    bool active = true;
    std::vector<int> output_list{2, 4, 1};
    Vec3<double> hemisphere = Vec3<double>::UnitX();
    Vec3<double> tip_m = Vec3<double>::Zero();
    Vec3<double> boresight_reference_deg = Vec3<double>::Zero();  // azimuth, elevation, roll
    std::array<Vec3<double>, 3> alignment_m{kAlignment_m};        // as set: origin, point on the x axis, point towards +y
    Vec3<double> mounting_deg = Vec3<double>::Zero();  // azimuth, elevation, roll of the mounting frame in the source frame
    tracking::OutputFrame<double> frame;               // its source frame is the mounting frame here
    double increment_m = 0;                            // movement that a record of the continuous mode needs; 0: none
    Envelope position_limits_m{2, 2, 2, -2, -2, -2};
    Envelope attitude_limits_deg{180, 90, 180, -180, -90, -180};  // azimuth, elevation, roll
    bool point_mode = true;  // the stylus button requests records; false: only item 16 shows it
};

struct Settings {
    std::array<StationSettings, kStations> stations;
    bool binary = false;
    bool centimetres = false;
    bool continuous = false;
    bool metal_compensation = false;                                             // only shown in the status record
    int baud = 0;                                                                // of a serial port; 0: as it was opened
    std::string identification = "tricoil, as a FASTRAK";                        // at most kIdentificationSize characters
    std::array<std::array<double, 4>, 2> filters{kMediumFilter, kMediumFilter};  // x and v: stored, not used

    [[nodiscard]] double units_per_m() const { return centimetres ? 100 : 1 / 0.0254; }
};

}  // namespace tricoil::host::fastrak
