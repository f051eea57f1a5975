#include "board/pose_source/open_source.hpp"

#include <array>
#include <string_view>
#include <utility>

#include "board/linux/device_config.hpp"
#include "board/linux/link_source.hpp"
#include "board/linux/text_name.hpp"
#include "board/record/recorded_source.hpp"
#include "board/simulation/simulated_source.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kForms =
    "can:INTERFACE, usb:VENDOR:PRODUCT, serial:PATH, columns:WHERE, couplings:WHERE, poses:WHERE, sim:SCENARIO, recording:FOLDER "
    "or a .toml "
    "configuration file";

template <typename Number>
Number number_of(const std::string& key, const std::string& text) {
    if (const auto value = number_from<Number>(text)) {
        return *value;
    }
    throw InputError("sim: " + key + "=" + text + ": not a valid number");
}

bool yes_or_no(const std::string& key, const std::string& text) {
    return index_of_name("value of " + key, text, {"no", "yes"}) == 1;
}

struct SimulationName {
    SimulationOptions options;
    bool realtime = false;
};

void set_key(SimulationName& name, const std::string& key, const std::string& value) {
    SimulationOptions& o = name.options;
    switch (index_of_name("key of sim:", key, {"mux", "rate_hz", "duration_s", "seed", "noise", "stations", "realtime"})) {
        case 0:
            o.multiplexing = value;
            break;
        case 1:
            o.frame_rate_hz = number_of<double>(key, value);
            break;
        case 2:
            o.duration_s = number_of<double>(key, value);
            break;
        case 3:
            o.seed = number_of<std::uint64_t>(key, value);
            break;
        case 4:
            o.no_noise = !yes_or_no(key, value);
            break;
        case 5:
            o.stations = number_of<int>(key, value);
            break;
        default:
            name.realtime = yes_or_no(key, value);
    }
}

/// Text after "sim:".
SimulationName parse_simulation(const std::string& text) {
    SimulationName name;
    const auto parts = split(text, ',');
    const bool has_scenario = parts.front().find('=') == std::string_view::npos;
    if (has_scenario && !parts.front().empty()) {
        name.options.scenario = parts.front();
    }
    for (std::size_t i = has_scenario ? 1 : 0; i < parts.size(); ++i) {
        const auto [key, value] = key_and_value(parts[i], "sim");
        set_key(name, key, value);
    }
    return name;
}

/// Replaces the names of the program's options in a message by the names of the keys.
std::string in_keys(std::string message) {
    constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kNames{{{"--mux", "mux"},
                                                                                   {"--rate-hz", "rate_hz"},
                                                                                   {"--duration", "duration_s"},
                                                                                   {"--tracker", "tracker"},
                                                                                   {"--stations", "stations"}}};
    for (const auto& [option, key] : kNames) {
        for (std::size_t at = message.find(option); at != std::string::npos; at = message.find(option)) {
            message.replace(at, option.size(), key);
        }
    }
    return message;
}

/// Owner is an object with the member `source`.
template <typename Owner>
std::shared_ptr<Source> source_of(std::shared_ptr<Owner> owner) {
    Source* const source = &owner->source();
    return {std::move(owner), source};
}

/// A recording without columns (the device computed the poses) gives its recorded poses.
class OwnRecording {
public:
    OwnRecording(const std::string& folder, const std::string& tracker, tracking::TrackerTap<double>& tap)
        : recording_(folder), trackers_(tap), source_(recording_, settings_of(recording_, tracker), trackers_) {}

    [[nodiscard]] Source& source() { return source_; }

private:
    Recording recording_;
    TrackerStage trackers_;
    RecordedSource source_;
};

std::unique_ptr<PoseSource> open_simulation(const std::string& text, const std::string& tracker) {
    SimulationName simulation = parse_simulation(text);
    simulation.options.tracker = tracker.empty() ? simulation.options.tracker : tracker;
    try {
        return std::make_unique<PoseSource>(
            [&](auto& tap) { return source_of(std::make_shared<OwnSimulation>(simulation.options, tap)); }, simulation.realtime);
    } catch (const InputError& error) {
        throw InputError("sim: " + in_keys(error.what()));
    }
}

std::unique_ptr<PoseSource> open_recording(const std::string& folder, const std::string& tracker) {
    return std::make_unique<PoseSource>(
        [&](auto& tap) { return source_of(std::make_shared<OwnRecording>(folder, tracker, tap)); }, false);
}

std::unique_ptr<PoseSource> open_device(const std::string& name, const std::string& tracker) {
    linux_board::DeviceConfig config;
    if (name.ends_with(".toml")) {
        config = linux_board::load_device_config(name);
        refuse_if(config.device.empty(), "{}: 'device' is missing; set it there", name);
    } else {
        linux_board::set_device(config, name);
    }
    config.method = tracker.empty() ? config.method : tracker;
    const auto calibration = config.calibration.empty() ? std::nullopt : std::optional(read_coils(config.calibration));
    return std::make_unique<PoseSource>(
        [&](auto& tap) { return std::shared_ptr<Source>(linux_board::open_link(config, calibration, tap)); }, false);
}

}  // namespace

std::unique_ptr<PoseSource> open_source(const std::string& name, const std::string& tracker) {
    const std::size_t colon = name.find(':');
    const std::string scheme = name.substr(0, colon == std::string::npos ? 0 : colon);
    const std::string rest = colon == std::string::npos ? "" : name.substr(colon + 1);
    if (scheme == "sim") {
        return open_simulation(rest, tracker);
    }
    if (scheme == "recording") {
        return open_recording(rest, tracker);
    }
    if (linux_board::is_text_source(name) || scheme == "can" || scheme == "usb" || scheme == "serial" ||
        name.ends_with(".toml")) {
        return open_device(name, tracker);
    }
    throw InputError("unknown source of poses '" + name + "'; use " + kForms);
}

}  // namespace tricoil::host
