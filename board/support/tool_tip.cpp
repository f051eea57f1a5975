#include "board/support/tool_tip.hpp"

#include <fmt/format.h>

#include "board/support/checked_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/text_table.hpp"
#include "core/linear/cholesky.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::host {
namespace {

constexpr double kLongestTip_m = 100;
constexpr double kWidest_m2 = 1;        // largest variance
constexpr double kAsymmetry_m2 = 1e-9;  // rounding errors of a covariance
constexpr const char* kFar = "must lie within 100 m of the sensor";
constexpr const char* kNoCovariance = "must be a covariance: symmetric, with no negative variance, at most 1 m2";

[[noreturn]] void refuse(const std::string& text) {
    throw InputError("--tip " + text + ": give X,Y,Z (m, sensor frame), SENSOR:X,Y,Z, or a .toml file of calibrate pivot");
}

template <typename T>
T parse_all(std::string_view field, const std::string& text) {
    const auto value = number_from<T>(field);
    if (!value) {
        refuse(text);
    }
    return *value;
}

ToolTip parse_tip(const std::string& text) {
    if (text.ends_with(".toml")) {
        return read_tip(text);
    }
    ToolTip tip;
    std::string_view numbers = text;
    if (const auto colon = numbers.find(':'); colon != std::string_view::npos) {
        tip.sensor = parse_all<std::uint8_t>(numbers.substr(0, colon), text);
        numbers.remove_prefix(colon + 1);
    }
    const auto fields = split(numbers, ',');
    if (fields.size() != 3) {
        refuse(text);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        tip.tip_m(static_cast<Index>(i)) = parse_all<double>(fields[i], text);
    }
    return tip;
}

bool is_near(const Vec3<double>& tip_m) { return tip_m.allFinite() && tip_m.cwiseAbs().maxCoeff() <= kLongestTip_m; }

/// Symmetric, and no eigenvalue is below -kAsymmetry_m2.
bool is_covariance(const Mat3<double>& m) {
    const Cholesky<double, 3> shifted(m + kAsymmetry_m2 * Mat3<double>::Identity());
    return m.allFinite() && m.cwiseAbs().maxCoeff() <= kWidest_m2 && (m - m.transpose()).cwiseAbs().maxCoeff() <= kAsymmetry_m2 &&
           shifted.ok();
}

/// Why no sensor can have this tip; empty: it can.
std::string_view fault_of(const ToolTip& tip) {
    return tip.sensor >= tracking::kMaxSensors ? "the sensor must be 0 to 3"
           : !is_near(tip.tip_m)               ? kFar
           : !is_covariance(tip.covariance_m2) ? kNoCovariance
                                               : "";
}

}  // namespace

std::string to_toml(const ToolTip& tip) {
    std::string text = "# Tip of a tool, by tricoil calibrate pivot. Metres, sensor frame.\nversion = 1\nkind = \"tip\"\n";
    return text + fmt::format("sensor = {}\ntip_m = {}\ncovariance_m2 = {}\n", tip.sensor, toml_text(tip.tip_m),
                              toml_text(tip.covariance_m2));
}

ToolTip read_tip(const std::string& path) {
    const toml::table root = parse_toml(path, read_text(path, kLongestToml));
    refuse_if(root["kind"].value_or(std::string()) != "tip", "{}: is not a tip; write it with tricoil calibrate pivot", path);
    CheckedTable table(path, "", root);
    table.require(table.number("version", 0) == 1, "version", "must be 1; calibrate again with this program");
    (void)table.text("kind", "");
    ToolTip tip;
    tip.sensor = static_cast<std::uint8_t>(table.whole("sensor", 0, tracking::kMaxSensors - 1));
    refuse_if(!table.has("tip_m"), "{}: 'tip_m' is missing; the file is not complete: calibrate again", path);
    tip.tip_m = table.vector("tip_m", tip.tip_m);
    table.require(is_near(tip.tip_m), "tip_m", kFar);
    tip.covariance_m2 = table.matrix("covariance_m2", tip.covariance_m2);
    table.require(is_covariance(tip.covariance_m2), "covariance_m2", kNoCovariance);
    table.finish();
    return tip;
}

ToolTips::ToolTips(const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
        const ToolTip tip = parse_tip(text);
        refuse_if(has(tip.sensor), "--tip {}: sensor {} has a tip already", text, tip.sensor);
        const std::string_view fault = set(tip);
        refuse_if(!fault.empty(), "--tip {}: {}", text, fault);
    }
}

std::string_view ToolTips::set(const ToolTip& tip) {
    const std::string_view fault = fault_of(tip);
    if (fault.empty()) {
        tips_[tip.sensor] = tip;
    }
    return fault;
}

tracking::PoseEstimate<double> ToolTips::at_tip(const tracking::PoseEstimate<double>& pose) const {
    if (!has(pose.sensor)) {
        return pose;
    }
    const ToolTip& tip = *tips_[pose.sensor];
    tracking::OutputFrame<double> frame;
    frame.tip_m = tip.tip_m;
    auto seen = tracking::in_frame(pose, frame);
    const Mat3<double> turn = pose.q_source_sensor.toRotationMatrix();
    seen.covariance.topLeftCorner<3, 3>() += turn * tip.covariance_m2 * turn.transpose();
    return seen;
}

}  // namespace tricoil::host
