#include "board/host/serve/fastrak/records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/base/angle_units.hpp"

namespace tricoil::host::fastrak {
namespace {

using Pose = tracking::PoseEstimate<double>;
using tracking::PoseFlag;

constexpr const char* kVersion = "0.1.00";

constexpr NumberForm kTenThousandths{7, 4, 9.9999, ""};  // Sx.xxxx

/// Right-aligned, and limited to magnitudes that fit with a minus sign. 0 for NaN.
std::string fixed_point(double value, const NumberForm& form) {
    const double safe = std::isnan(value) ? 0 : std::clamp(value, -form.limit, form.limit);
    return fmt::format("{:{}.{}f}{}", safe == 0 ? 0.0 : safe, form.width, form.digits, form.after);  // -0 is written as 0
}

std::string exponential(double value) {
    const double safe = std::isfinite(value) ? value : 0;
    return fmt::format("{: .5E} ", std::abs(safe) < 1e-98 ? 0.0 : safe);
}

std::string little_endian(double value) {
    const auto narrow = static_cast<float>(std::isfinite(value) ? value : 0);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &narrow, sizeof bits);
    std::string bytes(4, '\0');
    for (unsigned n = 0; n < 4; ++n) {
        bytes[n] = static_cast<char>(bits >> (8 * n) & 0xFFU);
    }
    return bytes;
}

/// Azimuth, elevation and roll.
Vec3<double> euler_deg(const Pose& pose) {
    const auto e = geometry::to_euler<double>(geometry::attitude_matrix(pose.q_source_sensor));
    return kDegrees * Vec3<double>(e.azimuth_rad, e.elevation_rad, e.roll_rad);
}

bool is_outside(const Vec3<double>& values, const Envelope& limits) {
    constexpr double kRounding = 1e-9;  // of limits that were given in inches, and of angles at 180 degrees
    for (std::size_t n = 0; n < 3; ++n) {
        const double value = values[static_cast<Index>(n)];
        if (value > limits[n] + kRounding || value < limits[n + 3] - kRounding) {
            return true;
        }
    }
    return false;
}

/// Numbers of one item; empty for text.
std::vector<double> numbers_of(Item item, const Settings& settings, const Pose& pose, const Vec3<double>& previous_m) {
    const double scale = settings.units_per_m();
    const Quat<double>& q = pose.q_source_sensor;
    const auto three = [](const Vec3<double>& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
    switch (item) {
        case Item::position:
            return three(scale * pose.position_m);
        case Item::movement:
            return three(scale * (pose.position_m - previous_m));
        case Item::euler:
            return three(euler_deg(pose));
        case Item::x_cosines:
        case Item::y_cosines:
        case Item::z_cosines:
            return three(q.toRotationMatrix().row(static_cast<int>(item) - static_cast<int>(Item::x_cosines)));
        case Item::quaternion:
            return {q.w(), q.x(), q.y(), q.z()};
        default:
            return {};
    }
}

std::size_t count_of(Item item) {
    static const Settings kSettings;
    return numbers_of(item, kSettings, Pose{}, Vec3<double>::Zero()).size();
}

std::string text_of(Item item, bool is_pressed = false) {
    switch (item) {
        case Item::space:
            return " ";
        case Item::line_end:
            return "\r\n";
        default:
            // The manual gives one character; the drivers of VRPN and Vrui read a blank before it, in both formats.
            return is_pressed ? " 1" : " 0";
    }
}

Item plain(int item) { return static_cast<Item>(item >= kExtended ? item - kExtended : item); }

bool has_few_decimals(Item item) { return item == Item::position || item == Item::movement || item == Item::euler; }

std::string format(int item, double value, bool binary) {
    if (binary) {
        return little_endian(value);
    }
    if (item >= kExtended) {
        return exponential(value);
    }
    return fixed_point(value, has_few_decimals(plain(item)) ? kHundredths : kTenThousandths);
}

}  // namespace

char error_letter(const Pose& pose) {
    constexpr std::array<std::pair<PoseFlag, char>, 11> kLetters{{{PoseFlag::no_reference, 'a'},
                                                                  {PoseFlag::saturated, 'j'},
                                                                  {PoseFlag::no_sensor, 'l'},
                                                                  {PoseFlag::stale, 'l'},
                                                                  {PoseFlag::low_signal, 'k'},
                                                                  {PoseFlag::wrong_handedness, 'g'},
                                                                  {PoseFlag::not_converged, 's'},
                                                                  {PoseFlag::hemisphere_unknown, 's'},
                                                                  {PoseFlag::unconfirmed, 's'},
                                                                  {PoseFlag::inconsistent, 's'},
                                                                  {PoseFlag::uncertain, 's'}}};
    for (const auto& [flag, letter] : kLetters) {
        if (pose.flags.has(flag)) {
            return letter;
        }
    }
    return ' ';
}

char error_letter(const Pose& pose, const StationSettings& limits) {
    if (const char letter = error_letter(pose); letter != ' ') {
        return letter;
    }
    if (is_outside(pose.position_m, limits.position_limits_m)) {
        return 'x';
    }
    return is_outside(euler_deg(pose), limits.attitude_limits_deg) ? 'y' : ' ';
}

bool is_item(int item) {
    constexpr std::array kItems{0, 1, 2, 3, 4, 5, 6, 7, 11, 16};
    return item >= 0 && std::find(kItems.begin(), kItems.end(), static_cast<int>(plain(item))) != kItems.end();
}

std::size_t record_size(const std::vector<int>& output_list, bool binary) {
    std::size_t bytes = 3;
    for (const int item : output_list) {
        const std::size_t count = count_of(plain(item));
        bytes += count == 0 ? text_of(plain(item)).size() : count * format(item, 0, binary).size();
    }
    return bytes;
}

std::string data_record(const Settings& settings, int station, const Pose& pose, char letter, const Vec3<double>& previous_m,
                        bool is_pressed) {
    std::string record = fmt::format("0{}{}", station, letter);
    for (const int item : settings.stations[static_cast<std::size_t>(station - 1)].output_list) {
        const auto numbers = numbers_of(plain(item), settings, pose, previous_m);
        for (const double number : numbers) {
            record += format(item, number, settings.binary);
        }
        if (numbers.empty()) {
            record += text_of(plain(item), is_pressed);
        }
    }
    return record;
}

std::string status_record(const Settings& settings, int station, int sensors, char letter) {
    const unsigned flags = 0x3F0U | (settings.binary ? 1U : 0U) | (settings.centimetres ? 2U : 0U) |
                           (settings.metal_compensation ? 4U : 0U) | (settings.continuous ? 8U : 0U);
    const std::string bit = letter == ' ' ? "   " : fmt::format("{:3d}", static_cast<int>(letter));
    const unsigned map = (1U << static_cast<unsigned>(sensors)) - 1;
    return fmt::format("2{}S{:03X}{} F3{:X}  {:<6}{:<32}\r\n", station, flags, bit, map, kVersion, settings.identification);
}

std::string values_record(int station, char command, std::span<const double> values, const NumberForm& form) {
    std::string record = fmt::format("2{}{}", station, command);
    for (const double value : values) {
        record += fixed_point(value, form);
    }
    return record + "\r\n";
}

std::string text_record(std::string_view station, char command, std::string_view text) {
    return fmt::format("2{}{}{}\r\n", station, command, text);
}

std::string error_record(std::string_view command, CommandError error, std::size_t position, std::size_t field, int station) {
    std::string shown;
    for (const char c : command) {
        shown += c >= ' ' && c <= '~' ? c : '?';
    }
    return fmt::format("2 E*ERROR*{}*ERROR* EC{:d}*PS{}*FL{}*ST{}\r\n", shown, static_cast<int>(error), position, field,
                       std::max(station - 1, 0));
}

}  // namespace tricoil::host::fastrak
