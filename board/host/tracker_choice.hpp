// The trackers that a person chooses from, by name.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "board/host/errors.hpp"
#include "board/host/names.hpp"
#include "core/fixed/tracker.hpp"
#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/tracker.hpp"

namespace tricoil::host {

/// Methods in the order of tracking::Method, then the filter.
inline const std::vector<std::string> kTrackerNames{"direct", "previous", "previous-angles", "scaat"};

/// Trackers in integers, in the order of fixed::Method.
inline const std::vector<std::string> kFixedTrackerNames{"fixed-direct", "fixed-previous"};

/// The method of an integer tracker; none for any other name.
inline std::optional<fixed::Method> fixed_method(const std::string& typed) {
    const auto found = std::find(kFixedTrackerNames.begin(), kFixedTrackerNames.end(), typed);
    if (found == kFixedTrackerNames.end()) {
        return std::nullopt;
    }
    return static_cast<fixed::Method>(found - kFixedTrackerNames.begin());
}

struct TrackerChoice {
    tracking::Method method = tracking::Method::direct;  // what a filter starts from
    bool filters = false;
};

/// What --tracker says. Throws InputError for an unknown name, and for an integer tracker: columns are not enough for it.
inline TrackerChoice tracker_choice(const std::string& typed) {
    if (fixed_method(typed)) {
        throw InputError("--tracker " + typed +
                         ": computes poses from samples, which only a simulated run has; use direct, previous "
                         "or scaat for columns");
    }
    std::vector<std::string> names = kTrackerNames;
    names.insert(names.end(), kFixedTrackerNames.begin(), kFixedTrackerNames.end());
    const std::size_t n = index_of_name("--tracker", typed, names);
    const bool filters = n + 1 == kTrackerNames.size();
    return {filters ? tracking::Method::direct : static_cast<tracking::Method>(n), filters};
}

/// The filter for what a tracker was told of its device and of where the sensor is.
inline tracking::scaat::Params<double> filter_like(const tracking::TrackerParams<double>& tracker) {
    tracking::scaat::Params<double> filter;
    filter.hemisphere = tracker.hemisphere;
    filter.confined = tracker.confined;
    filter.max_column_span = tracker.max_column_span;
    filter.window_s = tracker.window_s;
    return filter;
}

}  // namespace tricoil::host
