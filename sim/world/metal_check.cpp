#include "sim/world/metal_check.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace tricoil::sim {
namespace {

constexpr std::ptrdiff_t kMostObjects = 50;
constexpr double kLongest_s = 100;
constexpr double kStep_s = 1e-3;
constexpr double kMaxSteps = 1e6;

void check_object(const MetalObject& object, const Motion& motion, double begin_s, double end_s) {
    const double length_s = end_s - begin_s;
    const double step_s = std::min(kStep_s, passing_s(object) / 2);
    const int steps = static_cast<int>(std::clamp(std::ceil(length_s / step_s), 1.0, kMaxSteps));
    for (int i = 0; i <= steps; ++i) {
        const double time_s = begin_s + i * length_s / steps;
        const bool at_source = contains_at(object, Vec3<double>::Zero(), time_s);
        const bool is_sensor_checked = i == 0 || !object.is_at_rest();
        if (at_source || (is_sensor_checked && contains_at(object, motion.at(time_s).position_m, time_s))) {
            throw std::invalid_argument(fmt::format("metal: the {} contains the {} coils at {:.3f} s; move it or make it smaller",
                                                    shape_name(object.shape), at_source ? "source" : "sensor", time_s));
        }
    }
}

}  // namespace

void check_metal(const Scenario& scenario) {
    const auto is_metal = [](const Fault& fault) { return fault.metal.has_value(); };
    if (const auto objects = std::count_if(scenario.faults.begin(), scenario.faults.end(), is_metal); objects > kMostObjects) {
        throw std::invalid_argument(fmt::format("metal: {} objects; at most {} are possible", objects, kMostObjects));
    }
    for (const Fault& fault : scenario.faults) {
        const double end_s = std::min({fault.end_s, fault.begin_s + kLongest_s, scenario.duration_s});
        if (fault.metal && end_s > fault.begin_s) {
            check_object(*fault.metal, *scenario.motion, fault.begin_s, end_s);
        }
    }
}

}  // namespace tricoil::sim
