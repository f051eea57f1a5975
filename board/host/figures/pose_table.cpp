#include "board/host/figures/pose_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "board/pose_text/pose_stages.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/progress.hpp"
#include "board/support/text_table.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

PoseTable table_of_recording(const std::string& folder, const OutputOptions& options) {
    PoseTable table;
    const Recording recording(folder);
    PoseTap drawn([&](const tracking::PoseEstimate<double>& pose) {
        table[pose.sensor].push_back(
            {to_seconds(pose.time.since_start()), pose.valid(), pose.flags, pose.position_m, tracking::deviation_m(pose), kNaN});
    });
    PoseStages stages(options, drawn);
    RecordLines lines(folder, RecordFile::poses);
    Progress progress("plot: reading");
    for (std::string line; lines.next(line);) {
        progress.show(lines.share());
        stages.pose(parse_pose(line, lines.where()));
    }
    stages.finish();
    return table;
}

/// One line of a CSV file.
class Row {
public:
    Row(const std::vector<std::string_view>& names, const std::string& line, const TextPlace& place)
        : names_(names), fields_(split(line, ',')), place_(place) {
        if (fields_.size() != names.size()) {
            throw InputError(fmt::format("{}: {} fields; the header has {}", place.str(), fields_.size(), names.size()));
        }
    }
    /// Empty if there is no such column, or its field is empty.
    [[nodiscard]] std::optional<double> find(std::string_view name) const {
        const auto at = static_cast<std::size_t>(std::find(names_.begin(), names_.end(), name) - names_.begin());
        return at == names_.size() || fields_[at].empty() ? std::nullopt : std::optional(parse_number(fields_[at], place_));
    }
    [[nodiscard]] double number(std::string_view name) const {
        const auto value = find(name);
        if (!value) {
            throw InputError(fmt::format("{}: {} is missing; give the file of run --out in metres, or the folder of a recording",
                                         place_.str(), name));
        }
        return *value;
    }

private:
    const std::vector<std::string_view>& names_;
    std::vector<std::string_view> fields_;
    const TextPlace& place_;
};

DrawnPose to_drawn_pose(const Row& row, const TextPlace& place) {
    DrawnPose pose;
    const auto time_us = row.find("time_us");
    pose.time_s = time_us ? 1e-6 * *time_us : row.number("time_s");
    const double bits = row.find("flags").value_or(0);
    if (!(bits >= 0 && bits <= tracking::kAllPoseFlags.bits()) || bits != std::floor(bits)) {
        throw InputError(fmt::format("{}: {} has unknown flags", place.str(), bits));
    }
    for (unsigned bit = 0; tracking::kAllPoseFlags.bits() >> bit != 0; ++bit) {
        pose.flags.set_if((static_cast<std::uint32_t>(bits) >> bit & 1U) != 0, static_cast<tracking::PoseFlag>(bit));
    }
    pose.valid = row.find("valid").value_or(1) != 0;
    if (pose.valid) {
        pose.position_m = {row.number("x_m"), row.number("y_m"), row.number("z_m")};
    }
    const auto x = row.find("std_x_m");
    pose.deviation_m = x ? std::hypot(*x, row.number("std_y_m"), row.number("std_z_m")) : kNaN;
    pose.error_m = row.find("error_position_m").value_or(kNaN);
    return pose;
}

PoseTable table_of_csv(const std::string& path) {
    PoseTable table;
    const auto lines = read_lines(path);
    const auto names = split(lines.front(), ',');
    for (std::size_t n = 1; n < lines.size(); ++n) {
        const TextPlace place{path, n + 1};
        const Row row(names, lines[n], place);
        const double sensor = row.find("sensor").value_or(0);
        if (!(sensor >= 0 && sensor < tracking::kMaxSensors)) {
            throw InputError(fmt::format("{}: sensor {:g} must be 0 to {}", place.str(), sensor, tracking::kMaxSensors - 1));
        }
        table[static_cast<std::uint8_t>(sensor)].push_back(to_drawn_pose(row, place));
    }
    return table;
}

}  // namespace

PoseTable read_pose_table(const std::string& path, const OutputOptions& stages) {
    PoseTable table = std::filesystem::is_directory(path) ? table_of_recording(path, stages) : table_of_csv(path);
    const auto has_valid = [](const auto& sensor) {
        return std::any_of(sensor.second.begin(), sensor.second.end(), [](const DrawnPose& pose) { return pose.valid; });
    };
    if (std::none_of(table.begin(), table.end(), has_valid)) {
        throw InputError(path + ": has no valid pose to draw");
    }
    return table;
}

}  // namespace tricoil::host
