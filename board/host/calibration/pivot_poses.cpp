#include "board/host/calibration/pivot_poses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <utility>

#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr double kLengthTolerance = 0.01;
constexpr std::size_t kNumbers = 13;
constexpr std::array<const char*, kNumbers> kPoseColumns{
    "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad"};
using Numbers = std::array<double, kNumbers>;

PivotPose to_pivot_pose(const Numbers& v, const std::string& where) {
    PivotPose pose;
    pose.position_m = Vec3<double>(v[0], v[1], v[2]);
    const Quat<double> q(v[3], v[4], v[5], v[6]);
    if (!(std::abs(q.norm() - 1) <= kLengthTolerance)) {
        throw InputError(fmt::format("{}: quaternion has length {:.3f}, not 1", where, q.norm()));
    }
    pose.q_source_sensor = q.normalized();
    for (std::size_t n = 0; n < 6; ++n) {
        const double deviation = v[7 + n];
        if (!(deviation >= 0)) {
            throw InputError(where + ": a standard deviation is negative");
        }
        pose.covariance(static_cast<Index>(n), static_cast<Index>(n)) = deviation * deviation;
    }
    return pose;
}

/// Records of the sensors in a file.
using Records = std::map<std::uint8_t, PivotRecord>;

void add(Records& records, double sensor, bool valid, const auto& read_pose, const std::string& where) {
    if (!(sensor >= 0 && sensor < tracking::kMaxSensors)) {
        throw InputError(fmt::format("{}: sensor {:g} must be 0 to {}", where, sensor, tracking::kMaxSensors - 1));
    }
    PivotRecord& record = records[static_cast<std::uint8_t>(sensor)];
    if (valid) {
        record.poses.push_back(read_pose());
    } else {
        ++record.invalid;
    }
}

Records read_recording(const std::string& folder) {
    Records records;
    const Recording recording(folder);
    RecordLines lines(folder, RecordFile::poses);
    for (std::string line; lines.next(line);) {
        const auto pose = parse_pose(line, lines.where());
        const auto convert = [&] { return PivotPose{pose.position_m, pose.q_source_sensor, pose.covariance}; };
        add(records, pose.sensor, pose.valid(), convert, lines.where());
    }
    return records;
}

Records read_pose_csv(const std::string& path, const std::vector<std::string>& lines) {
    const auto names = split(lines.front(), ',');
    const auto find = [&](std::string_view name) {
        return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    std::array<std::size_t, kNumbers> columns{};
    for (std::size_t n = 0; n < kNumbers; ++n) {
        columns[n] = find(kPoseColumns[n]);
        if (columns[n] == names.size()) {
            throw InputError(fmt::format("{}:1: no column {}; give the file of run --out in metres, or the folder of a recording",
                                         path, kPoseColumns[n]));
        }
    }
    const std::size_t sensor = find("sensor");
    const std::size_t valid = find("valid");
    Records records;
    for (std::size_t n = 1; n < lines.size(); ++n) {
        const TextPlace place{path, n + 1};
        const auto fields = split(lines[n], ',');
        if (fields.size() != names.size()) {
            throw InputError(fmt::format("{}: {} fields; the header has {}", place.str(), fields.size(), names.size()));
        }
        const auto optional_number = [&](std::size_t column, double absent) {
            return column < fields.size() ? parse_number(fields[column], place) : absent;
        };
        const auto convert = [&] {
            Numbers numbers{};
            for (std::size_t i = 0; i < kNumbers; ++i) {
                numbers[i] = parse_number(fields[columns[i]], place);
            }
            return to_pivot_pose(numbers, place.str());
        };
        add(records, optional_number(sensor, 0), optional_number(valid, 1) != 0, convert, place.str());
    }
    return records;
}

Records read_json_lines(const std::string& path, const std::vector<std::string>& lines) {
    Records records;
    for (std::size_t n = 0; n < lines.size(); ++n) {
        const TextPlace place{path, n + 1};
        const Json line = Json::parse(lines[n], nullptr, false);
        if (line.is_object() && !line.contains("position_m")) {
            continue;  // the summary of a device
        }
        const auto convert = [&] {
            Numbers numbers{};
            std::size_t at = 0;
            for (const auto& [key, count] : {std::pair("position_m", 3U), {"q_wxyz", 4U}, {"std_m_rad", 6U}}) {
                const Json list = line.value(key, Json());
                for (std::size_t i = 0; i < count; ++i) {
                    if (!list.is_array() || list.size() != count || !list[i].is_number()) {
                        throw InputError(fmt::format("{}: '{}' must be a list of {} numbers", place.str(), key, count));
                    }
                    numbers[at++] = list[i].get<double>();
                }
            }
            return to_pivot_pose(numbers, place.str());
        };
        if (!line.is_object()) {
            throw InputError(place.str() + ": is not a line of JSON; give JSON lines, a CSV file or the folder of a recording");
        }
        const Json sensor = line.value("sensor", Json(0));
        const Json valid = line.value("valid", Json(1));
        add(records, sensor.is_number() ? sensor.get<double>() : -1, valid != 0 && valid != false, convert, place.str());
    }
    return records;
}

Records read_records(const std::string& path) {
    if (std::filesystem::is_directory(path)) {
        return read_recording(path);
    }
    const auto lines = read_lines(path);
    return lines.front().starts_with('{') ? read_json_lines(path, lines) : read_pose_csv(path, lines);
}

}  // namespace

PivotRecord read_pivot_poses(const std::string& path, std::optional<std::uint8_t> sensor) {
    Records records = read_records(path);
    if (records.empty()) {
        throw InputError(path + ": has no poses");
    }
    if (!sensor && records.size() > 1) {
        std::vector<int> sensors;
        for (const auto& [number, record] : records) {
            sensors.push_back(number);
        }
        throw InputError(
            fmt::format("{}: has poses of sensors {}; select that of the pointer with --sensor", path, fmt::join(sensors, ", ")));
    }
    const auto found = sensor ? records.find(*sensor) : records.begin();
    if (found == records.end()) {
        throw InputError(fmt::format("{}: has no poses of sensor {}", path, *sensor));
    }
    found->second.name = path;
    found->second.sensor = found->first;
    return std::move(found->second);
}

}  // namespace tricoil::host
