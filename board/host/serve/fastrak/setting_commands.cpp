#include "board/host/serve/fastrak/setting_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "board/host/serve/fastrak/records.hpp"

namespace tricoil::host::fastrak {
namespace {

constexpr double kLargestAngle_deg = 180;
constexpr std::size_t kPositionFilter = 0;
constexpr std::size_t kAttitudeFilter = 1;

StationSettings& station_of(Settings& settings, int number) { return settings.stations[static_cast<std::size_t>(number - 1)]; }

bool is_whole(double value) { return value == std::floor(value); }

std::string output_list(Settings& settings, const Arguments& arguments) {
    const int number = arguments.station();
    const std::size_t count = arguments.count_from(1);
    StationSettings& s = station_of(settings, number);
    if (count == 0) {
        std::string items;
        for (const int item : s.output_list) {
            items += fmt::format("{:2d}", item);
        }
        return text_record(std::to_string(number), 'O', items);
    }
    std::vector<int> list;
    for (std::size_t n = 1; n <= count; ++n) {
        const double item = arguments.needed_number(n);
        if (!is_whole(item) || std::abs(item) > 100 || !is_item(static_cast<int>(item)) || n > kLongestList) {
            arguments.refuse(n, CommandError::out_of_range);
        }
        list.push_back(static_cast<int>(item));
    }
    if (record_size(list, false) > kLongestRecord) {
        arguments.refuse(count, CommandError::too_long);
    }
    s.output_list = list;
    return {};
}

/// Reads or sets three numbers of a station. scale: of its unit to that of the client.
std::string three_numbers(const Arguments& arguments, char letter, Vec3<double>& value, double scale, double largest,
                          const NumberForm& form) {
    const Vec3<double> present = scale * value;
    if (arguments.count_from(1) == 0) {
        return values_record(arguments.station(), letter, {present.data(), 3}, form);
    }
    value = arguments.vector(1, present, largest) / scale;
    return {};
}

std::string alignment(Settings& settings, const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station_of(settings, number);
    const double scale = settings.units_per_m();
    if (arguments.count_from(1) == 0) {
        std::array<double, 9> values{};
        for (std::size_t n = 0; n < values.size(); ++n) {
            values[n] = scale * s.alignment_m[n / 3][static_cast<Index>(n % 3)];
        }
        return values_record(number, 'A', values);
    }
    std::array<Vec3<double>, 3> seen;      // in the present alignment frame, like the poses that the user reads
    std::array<Vec3<double>, 3> mounting;  // in the mounting frame
    for (std::size_t n = 0; n < seen.size(); ++n) {
        seen[n] = arguments.vector(1 + 3 * n, scale * s.alignment_m[n], kLongest) / scale;
        mounting[n] = s.frame.origin_m + s.frame.q_source_alignment * seen[n];
    }
    if (!tracking::align(s.frame, mounting[0], mounting[1], mounting[2]).ok()) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    s.alignment_m = seen;
    return {};
}

std::string reset_alignment(Settings& settings, const Arguments& arguments) {
    StationSettings& s = station_of(settings, arguments.station());
    s.frame.origin_m.setZero();
    s.frame.q_source_alignment.setIdentity();
    s.alignment_m = kAlignment_m;
    return {};
}

std::string increment(Settings& settings, const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station_of(settings, number);
    const double scale = settings.units_per_m();
    const std::optional<double> wanted = arguments.number(1);
    if (!wanted) {
        const double value = scale * s.increment_m;
        return values_record(number, 'I', {&value, 1});
    }
    if (*wanted < 0 || *wanted > kLongest) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    s.increment_m = *wanted / scale;
    return {};
}

/// Q and V: three upper, then three lower limits.
std::string envelope(const Arguments& arguments, char letter, Envelope& limits, double scale, double largest,
                     const NumberForm& form) {
    const int number = arguments.station();
    Envelope values = limits;
    std::transform(values.begin(), values.end(), values.begin(), [&](double value) { return scale * value; });
    if (arguments.count_from(1) == 0) {
        return values_record(number, letter, values, form);
    }
    for (std::size_t n = 0; n < values.size(); ++n) {
        values[n] = arguments.number(1 + n, values[n], largest);
    }
    for (std::size_t n = 0; n < 3; ++n) {
        if (values[n] < values[n + 3]) {
            arguments.refuse(1 + n, CommandError::out_of_range);
        }
    }
    std::transform(values.begin(), values.end(), limits.begin(), [&](double value) { return value / scale; });
    return {};
}

std::string stylus_button(Settings& settings, const Arguments& arguments) {
    const bool has_station = arguments.number(0).has_value();
    const int number = has_station ? arguments.station() : kStylusStation;
    const double mode = arguments.needed_number(1);
    if (mode != 0 && mode != 1) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    station_of(settings, number).point_mode = mode == 1;
    return {};
}

std::string filter(Settings& settings, const Arguments& arguments, std::size_t which) {
    auto& values = settings.filters[which];
    const std::size_t count = arguments.count_from(0);
    if (count == 0) {
        std::string text;
        for (const double value : values) {
            text += fmt::format("{:7.3f}", value);
        }
        return text_record(" ", which == kPositionFilter ? 'x' : 'v', text);
    }
    const std::optional<double> first = arguments.number(0);
    if (count == 1 && first && *first >= 1) {  // predefined setting, 1 to 5; 1 and 2: no filter
        if (*first > 5 || !is_whole(*first)) {
            arguments.refuse(0, CommandError::out_of_range);
        }
        constexpr std::array kReadyMade{kNoFilter, kNoFilter, kWeakFilter, kMediumFilter, kStrongFilter};
        values = kReadyMade[static_cast<std::size_t>(*first) - 1];
        if (which == kAttitudeFilter) {  // the attitude filter also sets the position filter
            settings.filters[kPositionFilter] = values;
        }
        return {};
    }
    auto wanted = values;
    for (std::size_t n = 0; n < wanted.size(); ++n) {
        wanted[n] = arguments.number(n, values[n], 1);
        if (wanted[n] < 0) {
            arguments.refuse(n, CommandError::out_of_range);
        }
    }
    values = wanted;
    return {};
}

std::string identification(Settings& settings, const Arguments& arguments) {
    const std::string_view text = arguments.text();
    if (text.empty()) {
        return text_record(" ", 'X', fmt::format("{:<{}}", settings.identification, kIdentificationSize));
    }
    if (text.size() > kIdentificationSize) {
        arguments.refuse(0, CommandError::too_long);
    }
    if (std::any_of(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; })) {
        arguments.refuse(0, CommandError::out_of_range);
    }
    settings.identification = text;
    return {};
}

std::string synchronization(const Arguments& arguments) {
    const std::optional<double> mode = arguments.number(0);
    if (!mode) {
        return text_record(" ", 'y', "0");
    }
    if (*mode != 0) {
        arguments.refuse(0, *mode == 1 || *mode == 2 ? CommandError::not_configured : CommandError::out_of_range);
    }
    return {};
}

/// Rate in units of 100 baud, parity, bits, hardware handshake. Only no parity, 8 bits and no handshake are possible.
std::string output_port(Settings& settings, const Arguments& arguments) {
    constexpr std::array kBauds{2400, 4800, 9600, 19200, 38400, 57600, 115200};
    const double baud = 100 * arguments.needed_number(0);
    if (std::find(kBauds.begin(), kBauds.end(), baud) == kBauds.end()) {
        arguments.refuse(0, CommandError::out_of_range);
    }
    const std::string_view parity = arguments.text(1);
    if (parity.empty()) {
        arguments.refuse(1, CommandError::field_missing);
    }
    if (parity != "N") {
        arguments.refuse(1, parity == "O" || parity == "E" ? CommandError::not_configured : CommandError::out_of_range);
    }
    const double bits = arguments.needed_number(2);
    if (bits != 8) {
        arguments.refuse(2, bits == 7 ? CommandError::not_configured : CommandError::out_of_range);
    }
    if (const double handshake = arguments.number(3).value_or(0); handshake != 0) {
        arguments.refuse(3, handshake == 1 ? CommandError::not_configured : CommandError::out_of_range);
    }
    settings.baud = static_cast<int>(baud);
    return {};
}

}  // namespace

std::string execute_setting(Settings& settings, char letter, const Arguments& arguments) {
    const auto station = [&]() -> StationSettings& { return station_of(settings, arguments.station()); };
    switch (letter) {
        case 'O':
            return output_list(settings, arguments);
        case 'G':
            return three_numbers(arguments, 'G', station().boresight_reference_deg, 1, kLargestAngle_deg, kHundredths);
        case 'A':
            return alignment(settings, arguments);
        case 'R':
            return reset_alignment(settings, arguments);
        case 'N':
            return three_numbers(arguments, 'N', station().frame.tip_m, settings.units_per_m(), kLongest, kThousandths);
        case 'I':
            return increment(settings, arguments);
        case 'Q':
            return envelope(arguments, 'Q', station().attitude_limits_deg, 1, kLargestAngle_deg, kSpacedThousandths);
        case 'V':
            return envelope(arguments, 'V', station().position_limits_m, settings.units_per_m(), kLongest, kWideThousandths);
        case 'r':
            return three_numbers(arguments, 'r', station().mounting_deg, 1, kLargestAngle_deg, kWideThousandths);
        case 'e':
            return stylus_button(settings, arguments);
        case 'x':
            return filter(settings, arguments, kPositionFilter);
        case 'v':
            return filter(settings, arguments, kAttitudeFilter);
        case 'X':
            return identification(settings, arguments);
        case 'y':
            return synchronization(arguments);
        default:
            return output_port(settings, arguments);
    }
}

}  // namespace tricoil::host::fastrak
