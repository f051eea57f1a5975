// The records that a FASTRAK sends (Polhemus, FASTRAK user manual OPM00PI002: "S", "P", "O", "T", "l" and command errors).
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "board/host/serve/fastrak/station.hpp"

namespace tricoil::host::fastrak {

/// The error letter of a pose, a blank if there is none: j a signal is saturated, k it is low, l there is none (no sensor, or
/// none for a while), a the source is not driven, g coils are wired wrongly, s the solution is not to be trusted, x out of range.
char error_letter(const tracking::PoseEstimate<double>& pose);

/// One station's record by its output list; previous_m: the position of the record before, for item 3. pose is in the station's
/// frame already.
std::string data_record(const Settings& settings, int station, const tracking::PoseEstimate<double>& pose, char letter,
                        const Vec3<double>& previous_m);

/// Bytes that such a record takes; what the list may not exceed is kLongestRecord.
std::size_t record_size(const std::vector<int>& output_list, bool binary);
constexpr std::size_t kLongestRecord = 254;
constexpr std::size_t kLongestList = 32;
bool is_item(int item);

/// 55 bytes.
std::string status_record(const Settings& settings, int station, int sensors, char letter);

/// "2", station, letter of the command, the values as Sxxx.xx, line end.
std::string values_record(int station, char command, std::span<const double> values);
std::string text_record(std::string_view station, char command, std::string_view text);

/// Why a command is refused, by the manual's numbers.
enum class CommandError : int {
    field_missing = -1,
    not_numeric = -2,
    out_of_range = -3,
    not_configured = -4,
    too_long = -5,
    undefined = -99,
};

/// field: counted from 0 after the command's letter; position: of that field in the command.
std::string error_record(std::string_view command, CommandError error, std::size_t position, std::size_t field, int station);

}  // namespace tricoil::host::fastrak
