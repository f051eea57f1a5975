// The trackers that a person chooses from, by name.
#pragma once

#include <string>
#include <vector>

#include "board/support/nearest_name.hpp"
#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/tracker.hpp"

namespace tricoil::host {

/// Methods in the order of tracking::Method, then the filter.
inline const std::vector<std::string> kTrackerNames{"direct", "previous", "previous-angles", "scaat"};

struct TrackerChoice {
    tracking::Method method = tracking::Method::direct;  // what a filter starts from
    bool filters = false;
};

/// What --tracker says. Throws InputError for a name that is none.
inline TrackerChoice tracker_choice(const std::string& typed) {
    const std::size_t n = index_of_name("--tracker", typed, kTrackerNames);
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
