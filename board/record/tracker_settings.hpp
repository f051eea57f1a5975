// How the trackers of a run were made, as JSON: written into a recording, read back for its replay.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "hal/tracker_tap.hpp"

namespace tricoil::host {

using TrackerSettings = hal::TrackerTap<double>::Settings;

/// Keys "sensors", "tracker" ("method" and its parameters) and "calibration" (null: none; matrices by rows). Numbers are exact.
nlohmann::ordered_json settings_json(const TrackerSettings& settings);

/// Throws InputError, which names `where` and the key, for keys that are missing, unknown or of another type, and for settings
/// with which no tracker works.
TrackerSettings settings_from_json(const nlohmann::json& json, const std::string& where);

}  // namespace tricoil::host
