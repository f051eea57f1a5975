// Settings of the four stations (receivers) of a FASTRAK, and its records (Polhemus, FASTRAK user manual OPM00PI002: section 9,
// and 10 for command errors).
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
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

/// Error letter of a pose; blank: no error. j: saturated. k: low signal. l: no signal (no sensor, or no measurement for some
/// time). a: source not driven. g: wrong wiring. s: solution not reliable.
char error_letter(const tracking::PoseEstimate<double>& pose);
/// The same with the limits of a station. x: a coordinate beyond its limits ("V"). y: an angle beyond its limits ("Q"). pose: in
/// the coordinate frame of the station.
char error_letter(const tracking::PoseEstimate<double>& pose, const StationSettings& limits);

/// Record of one station with its output list. previous_m: position of the previous record, for item 3. pose: in the coordinate
/// frame of the station. is_pressed: the button of the stylus.
std::string data_record(const Settings& settings, int station, const tracking::PoseEstimate<double>& pose, char letter,
                        const Vec3<double>& previous_m, bool is_pressed);

/// Size of a data_record() in bytes. The limit of an ASCII record is kLongestRecord.
std::size_t record_size(const std::vector<int>& output_list, bool binary);
constexpr std::size_t kLongestRecord = 254;
constexpr std::size_t kLongestList = 32;
bool is_item(int item);

/// 55 bytes.
std::string status_record(const Settings& settings, int station, int sensors, char letter);

/// Format of one number.
struct NumberForm {
    int width;
    int digits;  // after the decimal point
    double limit;
    std::string_view after;
};
constexpr NumberForm kHundredths{7, 2, 999.99, ""};           // Sxxx.xx
constexpr NumberForm kThousandths{7, 3, 99.999, ""};          // Sxx.xxx
constexpr NumberForm kWideThousandths{8, 3, 999.999, ""};     // Sxxx.xxx
constexpr NumberForm kSpacedThousandths{8, 3, 999.999, " "};  // Sxxx.xxxb

/// "2", station, command letter, values, line end.
std::string values_record(int station, char command, std::span<const double> values, const NumberForm& form = kHundredths);
/// station: a digit, or a blank for commands of the whole device.
std::string text_record(std::string_view station, char command, std::string_view text);

/// Error codes of the manual.
enum class CommandError : int {
    field_missing = -1,
    not_numeric = -2,
    out_of_range = -3,
    not_configured = -4,
    too_long = -5,
    undefined = -99,
};

/// field: counted from 0 after the command's letter. position: of that field in the command. station: from 1; the record counts
/// from 0.
std::string error_record(std::string_view command, CommandError error, std::size_t position, std::size_t field, int station);

}  // namespace tricoil::host::fastrak
