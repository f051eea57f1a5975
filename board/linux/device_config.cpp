#include "board/linux/device_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "board/linux/device_uri.hpp"
#include "board/linux/text_name.hpp"
#include "board/support/checked_table.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/text_table.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::linux_board {
namespace {

using host::CheckedTable;

CoilLines coil_lines(CheckedTable table) {
    const std::string chip = table.text("chip", "");
    table.require(!chip.empty(), "chip", "is missing; give the name or label of the GPIO chip, see gpiodetect");
    const bool active_low = table.flag("active_low", false);
    CoilLines lines;
    constexpr std::array<const char*, 3> kKeys{"s1", "s2", "s3"};
    for (std::size_t i = 0; i < kKeys.size(); ++i) {
        lines.coils[i] = {chip, table.text(kKeys[i], ""), active_low};
        table.require(!lines.coils[i].line.empty(), kKeys[i], "is missing; give the name of the line, see gpioinfo");
        for (std::size_t other = 0; other < i; ++other) {
            table.require(lines.coils[other].line != lines.coils[i].line, kKeys[i], "is the line of another coil");
        }
    }
    const auto optional_line = [&](const char* key) {
        const std::string name = table.text(key, "");
        return name.empty() ? std::nullopt : std::optional(drivers::GpioLineName{chip, name, false});
    };
    lines.heartbeat = optional_line("heartbeat");
    lines.sync = optional_line("sync");
    const auto is_coil = [&](const auto& line) {
        return line &&
               std::any_of(lines.coils.begin(), lines.coils.end(), [&](const auto& coil) { return coil.line == line->line; });
    };
    table.require(!is_coil(lines.heartbeat), "heartbeat", "is the line of a coil; choose another line");
    table.require(!is_coil(lines.sync), "sync", "is the line of a coil; choose another line");
    const bool shared = lines.heartbeat && lines.sync && lines.heartbeat->line == lines.sync->line;
    table.require(!shared, "sync", "is the line of the heartbeat; choose another line");
    table.finish();
    return lines;
}

void read_front_end(CheckedTable table, DeviceConfig& config) {
    config.serial = table.whole("serial", 0, std::numeric_limits<std::int64_t>::max());
    table.finish();
}

void read_calibration(CheckedTable table, DeviceConfig& config) {
    config.calibration = table.text("file", "");
    table.require(config.calibration.empty() || !table.has("coupling_constant_m3"), "coupling_constant_m3",
                  "is part of the calibration file; remove this key or 'file'");
    config.coupling_constant_m3 = table.positive("coupling_constant_m3", config.coupling_constant_m3);
    table.finish();
}

void read_tracker(CheckedTable table, DeviceConfig& config) {
    const std::string method = table.text("method", "");
    config.method = method.empty() ? config.method : table.choice("method", host::kTrackerNames);
    config.hemisphere = table.has("hemisphere") ? std::optional(table.vector("hemisphere", {})) : config.hemisphere;
    config.confined = table.flag("confined", config.confined);
    table.finish();
}

void read_health(CheckedTable table, DeviceConfig& config) {
    constexpr double kLongestAge_ms = 1e6;
    host::HealthLimits& limits = config.health;
    const double percent = table.positive("missing_percent", 100 * limits.missing_share);
    const double age_ms = table.positive("age_ms", 1e3 * to_seconds(limits.age));
    table.require(percent <= 100, "missing_percent", "must be 100 or less");
    table.require(age_ms <= kLongestAge_ms, "age_ms", "must be 1e6 or less");
    limits.missing_share = percent / 100;
    limits.age = microseconds_from_seconds(1e-3 * age_ms);
    limits.temperature_c = table.number("temperature_c", limits.temperature_c);
    table.finish();
}

void read_outputs(CheckedTable table, DeviceConfig& config) {
    config.csv = table.text("csv", "");
    config.publish = table.flag("publish", false);
    table.finish();
}

void read_realtime(CheckedTable table, DeviceConfig& config) {
    config.priority = static_cast<int>(table.whole("priority", 0, 99));
    config.lock_memory = table.has("lock_memory") ? std::optional(table.flag("lock_memory", true)) : std::nullopt;
    table.finish();
}

}  // namespace

Vec3<double> direction_of(const std::string& name, std::string_view text) {
    const auto fields = host::split(text, '/');
    Vec3<double> direction = Vec3<double>::Zero();
    for (Index i = 0; i < 3 && fields.size() == 3; ++i) {
        direction(i) = host::number_from<double>(fields[static_cast<std::size_t>(i)]).value_or(std::nan(""));
    }
    host::refuse_if(!tracking::is_hemisphere(direction) || direction.isZero(0),
                    "device '{}': hemisphere must be a direction X/Y/Z, for example hemisphere=1/0/0", name);
    return direction;
}

DeviceConfig parse_device_config(const std::string& name, std::string_view text) {
    const toml::table parsed = host::parse_toml(name, text);
    CheckedTable root(name, "", parsed);
    DeviceConfig config;
    if (const std::string device = root.text("device", ""); !device.empty()) {
        try {
            set_device(config, device);
            if (is_text_source(config.device)) {
                parse_text_name(config.device);
            } else {
                parse_device_uri(config.device);
            }
        } catch (const host::InputError& error) {
            root.require(false, "device", error.what());
        }
    }
    const CheckedTable coils = root.child("coils");
    if (parsed.contains("coils")) {
        require(host::Component::gpio, name + ": [coils]");
        config.coils = coil_lines(coils);
    }
    read_front_end(root.child("front_end"), config);
    read_calibration(root.child("calibration"), config);
    read_tracker(root.child("tracker"), config);
    read_health(root.child("health"), config);
    read_outputs(root.child("outputs"), config);
    read_realtime(root.child("realtime"), config);
    root.finish();
    return config;
}

DeviceConfig load_device_config(const std::string& path) {
    DeviceConfig config = parse_device_config(path, host::read_text(path, host::kLongestToml));
    for (std::string* const file : {&config.calibration, &config.wiring}) {
        *file = file->empty() ? "" : (std::filesystem::path(path).parent_path() / *file).string();
    }
    return config;
}

void set_device(DeviceConfig& config, const std::string& name) {
    constexpr std::string_view kHemisphere = "hemisphere=";
    constexpr std::string_view kWiring = "wiring=";
    config.device.clear();
    for (const std::string_view part : host::split(name, ',')) {
        if (part == "confined") {
            config.confined = true;
        } else if (part.starts_with(kHemisphere)) {
            config.hemisphere = direction_of(name, part.substr(kHemisphere.size()));
        } else if (part.starts_with(kWiring)) {
            config.wiring = part.substr(kWiring.size());
        } else {
            host::refuse_if(!config.device.empty() && !is_text_source(name),
                            "device '{}': '{}' is not known; only hemisphere=X/Y/Z, wiring=FILE and confined may follow", name,
                            part);
            config.device.append(config.device.empty() ? "" : ",").append(part);
        }
    }
}

}  // namespace tricoil::linux_board
