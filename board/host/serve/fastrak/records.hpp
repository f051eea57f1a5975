// Records of a FASTRAK (Polhemus, FASTRAK user manual OPM00PI002: section 9, and 10 for command errors).
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "board/host/serve/fastrak/station.hpp"

namespace tricoil::host::fastrak {

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
