// Tracker settings of a run as JSON: written into a recording and read back for its replay.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

using TrackerSettings = tracking::TrackerTap<double>::Settings;

/// Keys: "sensors", "tracker" ("method" and its parameters) and "calibration" (null: none; matrices by rows). Numbers are exact.
nlohmann::ordered_json settings_json(const TrackerSettings& settings);

/// Throws InputError, naming `where` and the key, for missing or unknown keys, wrong types, and settings that the tracker does
/// not support.
TrackerSettings settings_from_json(const nlohmann::json& json, const std::string& where);

}  // namespace tricoil::host
