// Tips of tools on the sensors: text form, file, and their use on poses.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Offset of a tip from the sensor on its tool, with the covariance of its calibration. Sensor frame.
struct ToolTip {
    std::uint8_t sensor = 0;
    Vec3<double> tip_m = Vec3<double>::Zero();
    Mat3<double> covariance_m2 = Mat3<double>::Zero();
};

/// TOML file of a tip.
std::string to_toml(const ToolTip& tip);
/// Throws InputError, naming file and line, for any other file.
ToolTip read_tip(const std::string& path);

/// Tip of each sensor that has one.
class ToolTips {
public:
    ToolTips() = default;
    /// Texts of `--tip`: FILE.toml, or [SENSOR:]X,Y,Z in metres. Throws InputError, naming the option.
    explicit ToolTips(const std::vector<std::string>& texts);

    /// Why no sensor can have this tip, and nothing changes; empty: it is set.
    [[nodiscard]] std::string_view set(const ToolTip& tip);
    [[nodiscard]] bool has(std::size_t sensor) const { return sensor < tips_.size() && tips_[sensor].has_value(); }

    /// The pose with the position of the tip, if its sensor has one. The covariance of the position includes the error of the
    /// attitude, which moves the tip, and the covariance of the tip.
    [[nodiscard]] tracking::PoseEstimate<double> at_tip(const tracking::PoseEstimate<double>& pose) const;

private:
    std::array<std::optional<ToolTip>, tracking::kMaxSensors> tips_;
};

}  // namespace tricoil::host
