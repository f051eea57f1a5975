#include "board/host/demo/tour.hpp"

#include "board/support/interrupt.hpp"

namespace tricoil::host {
namespace {

constexpr double kUntilAKey_s = 1e9;

RunOptions tour_options(const std::string& scenario, const std::string& tracker) {
    RunOptions options;
    options.scenario = scenario;
    options.multiplexing = "tdm";
    options.tracker = tracker;
    options.duration_s = kUntilAKey_s;
    options.realtime = true;
    options.confined = true;  // the sensor stays on its side, also after it was unplugged
    return options;
}

RunOptions without_deskew(RunOptions options) {
    options.no_deskew = true;
    return options;
}

RunOptions with_fault(RunOptions options, const std::string& fault) {
    options.faults = {fault};
    return options;
}

}  // namespace

std::vector<TourStep> tour_steps() {
    return {
        {"a hand",
         "A sensor on a moving hand, 0.6 m from the source. The page shows its path, position, speed and predicted error.",
         tour_options("hand", "scaat")},
        {"motion, without the filter",
         "The sensor moves in a circle. The source coils carry current in turn, and three columns of different times are taken "
         "as simultaneous: the position error is some millimetres.",
         without_deskew(tour_options("circle", "direct"))},
        {"motion, with the filter", "The same circle. The filter uses each column at its own time: the motion error is gone.",
         tour_options("circle", "scaat")},
        {"metal",
         "An aluminium sphere of 16 cm beside the hand bends the field. Poses with a significant error are flagged as distorted.",
         tour_options("metal", "scaat")},
        {"unplugged sensor",
         "After 2 s the sensor is unplugged, and its poses become invalid. After 5 s it is plugged in again, and tracking "
         "resumes.",
         with_fault(tour_options("hand", "scaat"), "unplugged@2-5")},
    };
}

ScoreSummary run_step(const TourStep& step, tracking::TrackerTap<double>& tap, const std::function<bool()>& is_over,
                      const std::function<void(const LinkHealth&)>& each_health) {
    const BorrowedInterrupt end_of_step(is_over);
    RunObservers observers;
    observers.tap = &tap;
    observers.loop.each_health = each_health;
    return run_simulated(step.run, observers).score;
}

}  // namespace tricoil::host
