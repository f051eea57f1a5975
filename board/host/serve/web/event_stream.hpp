// Events for one live page.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "board/host/serve/silence_watch.hpp"
#include "board/host/serve/web/served_page.hpp"

namespace tricoil::host::web {

/// An event has all poses since the last one; a page that reads too slowly misses poses that the hub no longer has.
class EventStream {
public:
    explicit EventStream(ServedPage& page);

    /// The next event; empty if none is due: at most every 33 ms, and after 0.5 s also without a pose.
    std::string next();

private:
    using Clock = std::chrono::steady_clock;

    ServedPage& page_;
    PoseHub::Cursor cursor_;
    nlohmann::ordered_json hello_;  // null after the first event
    std::vector<ServedPose> poses_;
    SilenceWatch silence_;
    Clock::time_point last_ = Clock::now();
};

}  // namespace tricoil::host::web
