// Scripted tour of the live page with a simulated sensor: text and simulated run of each step.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "board/host/run/simulated_run.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

struct TourStep {
    std::string name;
    std::string shows;  // one or two sentences
    RunOptions run;
};

/// The steps, in order: hand, motion without and with the filter, metal, unplugged sensor.
std::vector<TourStep> tour_steps();

/// Runs a step in real time until `is_over`. The poses go to `tap`. Returns their errors against the true motion.
ScoreSummary run_step(const TourStep& step, tracking::TrackerTap<double>& tap, const std::function<bool()>& is_over,
                      const std::function<void(const LinkHealth&)>& each_health);

}  // namespace tricoil::host
