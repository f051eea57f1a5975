#include "board/simulation/stations.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/linear/eigen.hpp"
#include "sim/motion/simple_motions.hpp"

namespace tricoil::host {
namespace {

constexpr double kSway_m = 0.003;  // of a seated head
constexpr double kSway_hz = 0.2;
constexpr double kYaw_rad = 0.35;
constexpr std::uint64_t kSeedStep = 1000;

bool is_of_one_sensor(const sim::Fault& fault) {
    switch (fault.kind) {
        case sim::FaultKind::reversed_coil:
        case sim::FaultKind::swapped_coils:
            return fault.triad == sim::Triad::sensor;
        case sim::FaultKind::stuck_channel:
            return fault.channel < static_cast<int>(kSensorCoils);
        case sim::FaultKind::dropped_blocks:
        case sim::FaultKind::unplugged:
        case sim::FaultKind::overload:
            return true;
        default:
            return false;
    }
}

/// Pose of sensor 1, 2 or 3. Relative to the start of sensor 0, the position is 20 % of the range nearer to the source and 20 %
/// of the range to one side, in a different direction for each sensor. So all sensors are in one half space, apart from each
/// other.
sim::Pose place(const Vec3<double>& start_m, std::size_t sensor) {
    constexpr double kAside = 0.2;
    constexpr double kThird_rad = 2.0943951023931953;
    const double range = start_m.norm();
    const Vec3<double> ahead = start_m.normalized();
    const Vec3<double> side = eigen(ahead).unitOrthogonal();
    const double angle = kThird_rad * static_cast<double>(sensor - 1);
    const Vec3<double> aside = std::cos(angle) * side + std::sin(angle) * ahead.cross(side);
    return {range * ((1 - kAside) * ahead + kAside * aside),
            geometry::rotation_vector_to_quaternion<double>({0, 0, kYaw_rad * static_cast<double>(sensor)})};
}

}  // namespace

Stations::Stations(const SimulationSetup& setup) {
    const sim::Scenario& scenario = setup.scenario;
    worlds_.push_back(std::make_unique<sim::CoilWorld>(scenario.world, *scenario.motion, scenario.faults));
    std::vector<sim::Fault> common;
    std::remove_copy_if(scenario.faults.begin(), scenario.faults.end(), std::back_inserter(common), is_of_one_sensor);
    const Vec3<double> start_m = scenario.motion->at(0).position_m;
    for (std::size_t sensor = 1; sensor < static_cast<std::size_t>(setup.stations); ++sensor) {
        motions_.push_back(std::make_unique<sim::LineMotion>(place(start_m, sensor), Vec3<double>(0, 0, kSway_m), kSway_hz));
        sim::WorldParams params = scenario.world;
        params.seed += kSeedStep * sensor;
        worlds_.push_back(std::make_unique<sim::CoilWorld>(params, *motions_.back(), common));
    }
    for (const auto& world : worlds_) {
        world->configure(setup.plan);
    }
}

void Stations::add_further(sim::SimulatedCoilSampler& sampler) {
    std::for_each(worlds_.begin() + 1, worlds_.end(), [&](const auto& world) { sampler.add_sensor(*world); });
}

}  // namespace tricoil::host
