#include "board/host/calibration/pivot_poses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include "board/pose_text/pose_fields.hpp"
#include "board/pose_text/pose_table.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

PivotPose pivot_pose(const Vec3<double>& position_m, const Quat<double>& q, const Vec6<double>& deviations,
                     const std::string& where) {
    refuse_if(!(deviations.minCoeff() >= 0), "{}: a standard deviation is negative", where);
    PivotPose pose{position_m, normalised(q, where)};
    pose.covariance.diagonal() = deviations.cwiseAbs2();
    return pose;
}

/// Records of the sensors in a file.
using Records = std::map<std::uint8_t, PivotRecord>;

void add(Records& records, double sensor, bool valid, const auto& read_pose, const std::string& where) {
    refuse_if(!(sensor >= 0 && sensor < tracking::kMaxSensors), "{}: sensor {:g} must be 0 to {}", where, sensor,
              tracking::kMaxSensors - 1);
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

Records read_pose_table(LineReader lines) {
    Records records;
    Table rows(std::move(lines));
    const PoseTable table(rows);
    while (rows.next()) {
        const std::string where = rows.place().str();
        const auto convert = [&] {
            const Vec3<double> position_m = table.position_m();  // first, so that it is refused first
            return pivot_pose(position_m, table.attitude(), table.deviations(), where);
        };
        add(records, table.number("sensor", 0), table.number("valid", 1) != 0, convert, where);
    }
    return records;
}

template <int Size>
Matrix<double, Size, 1> numbers_of(const Json& line, const std::string& key, const std::string& where) {
    const Json list = line.value(key, Json());
    Matrix<double, Size, 1> numbers;
    for (std::size_t i = 0; i < Size; ++i) {
        refuse_if(!list.is_array() || list.size() != Size || !list[i].is_number(), "{}: '{}' must be a list of {} numbers", where,
                  key, Size);
        numbers(static_cast<Index>(i)) = list[i].get<double>();
    }
    return numbers;
}

Records read_json_lines(LineReader lines) {
    Records records;
    for (std::string text; lines.next(text);) {
        lines.refuse_long();
        const std::string where = TextPlace{lines.path(), lines.line()}.str();
        const Json line = Json::parse(text, nullptr, false);
        refuse_if(!line.is_object(), "{}: is not a line of JSON; give JSON lines, a CSV file or the folder of a recording",
                  where);
        const auto unit = std::ranges::find_if(kLengthUnits, [&](const auto& name) { return line.contains("position_" + name); });
        if (unit == kLengthUnits.end()) {
            continue;  // the summary of a device
        }
        const double metres = 1 / kUnitsPerMetre.at(static_cast<std::size_t>(unit - kLengthUnits.begin()));
        const auto convert = [&] {
            const Vec3<double> position_m = metres * numbers_of<3>(line, "position_" + *unit, where);
            const auto q = numbers_of<4>(line, "q_wxyz", where);
            auto deviations = numbers_of<6>(line, "std_" + *unit + "_rad", where);
            deviations.head<3>() *= metres;
            return pivot_pose(position_m, {q(0), q(1), q(2), q(3)}, deviations, where);
        };
        const Json sensor = line.value("sensor", Json(0));
        const Json valid = line.value("valid", Json(1));
        add(records, sensor.is_number() ? sensor.get<double>() : -1, valid != 0 && valid != false, convert, where);
    }
    return records;
}

Records read_records(const std::string& path) {
    if (std::filesystem::is_directory(path)) {
        return read_recording(path);
    }
    LineReader lines(path);
    return lines.starts_with("{") ? read_json_lines(std::move(lines)) : read_pose_table(std::move(lines));
}

}  // namespace

PivotRecord read_pivot_poses(const std::string& path, std::optional<std::uint8_t> sensor) {
    Records records = read_records(path);
    refuse_if(records.empty(), "{}: has no poses", path);
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
    found->second.sensor = found->first;
    return std::move(found->second);
}

}  // namespace tricoil::host
