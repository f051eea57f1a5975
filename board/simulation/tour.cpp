#include "board/simulation/tour.hpp"

#include <nlohmann/json.hpp>

namespace tricoil::host {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUntilAKey_s = 1e9;

}  // namespace

Json tour_steps() {
    const auto step = [](const char* name, const char* shows, const char* scenario, bool compensated = true,
                         const std::vector<std::string>& faults = {}) {
        return Json{{"name", name}, {"shows", shows}, {"scenario", scenario}, {"compensated", compensated}, {"faults", faults}};
    };
    return {
        step("a hand",
             "A simulated hand moves the sensor. Error: distance from the true position, which only a simulation knows. Expected "
             "error: what the tracker itself states.",
             "hand"),
        step("motion error",
             "The sensor moves on a circle. The coils are measured in turn. Without motion compensation, three measurements of "
             "different times count as simultaneous: the error grows with the speed, here to some millimetres.",
             "circle", false),
        step("motion compensation",
             "The same circle with motion compensation: a filter uses each measurement at its own time. Nearly all "
             "error of the motion is gone.",
             "circle"),
        step("metal",
             "An aluminium sphere of 16 cm beside the hand bends the field: the error grows with both methods, and the expected "
             "error too.",
             "hand", true, {"metal:0.6,0.35,0,0.08"}),
        step("unplugged sensor",
             "After 2 s the sensor is unplugged: no pose is usable. After 5 s it is plugged in again, and tracking resumes.",
             "hand", true, {"unplugged@2-5"}),
    };
}

SimulationOptions tour_options(const Json& step, bool compensated, double speed) {
    SimulationOptions options;
    options.scenario = step["scenario"].get<std::string>();
    options.multiplexing = "tdm";
    options.tracker = compensated ? "scaat" : "direct";
    options.no_deskew = !compensated;
    options.faults = step["faults"].get<std::vector<std::string>>();
    options.duration_s = kUntilAKey_s;
    options.speed = speed;
    options.confined = true;  // the sensor stays on its side, also after it was unplugged
    return options;
}

}  // namespace tricoil::host
